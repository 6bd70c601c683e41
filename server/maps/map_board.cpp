#include "server/maps/map_board.h"

#include <utility>

#include "server/maps/parameters.h"

namespace lumigraft::server {

std::optional<MapPicture> MapBoard::ask(MapKind kind, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_[static_cast<std::size_t>(kind)];
  // One from before a pause in asking is not shown any more.
  if (now - entry.asked > kMaps.asked_for) entry.newest.reset();
  entry.asked = now;
  return entry.newest;
}

std::optional<MapKind> MapBoard::due(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  std::optional<MapKind> oldest;
  for (const MapKind kind : kAllMaps) {
    const Entry& entry = entries_[static_cast<std::size_t>(kind)];
    if (now - entry.asked > kMaps.asked_for || now - entry.drawn < kMaps.apart) continue;
    if (!oldest || entry.drawn < entries_[static_cast<std::size_t>(*oldest)].drawn) oldest = kind;
  }
  return oldest;
}

void MapBoard::put(MapKind kind, MapPicture picture, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_[static_cast<std::size_t>(kind)];
  entry.newest = std::move(picture);
  entry.drawn = now;
}

void MapBoard::skip(MapKind kind, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  entries_[static_cast<std::size_t>(kind)].drawn = now;
}

}  // namespace lumigraft::server
