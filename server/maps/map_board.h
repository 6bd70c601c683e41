#pragma once
// Which maps are asked for, and the newest of each. A map is drawn only after somebody asked for it, for a few seconds.
//
// No clock: times are given. Any thread.
#include <array>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "server/maps/map_kind.h"

namespace lumigraft::server {

struct MapPicture {
  std::string jpeg;
  std::uint32_t sequence = 0;  ///< of the picture that it belongs to
};

class MapBoard {
 public:
  using Clock = std::chrono::steady_clock;

  /// The newest map, if it is one of the last seconds. Requests further ones.
  std::optional<MapPicture> ask(MapKind kind, Clock::time_point now);
  /// The map that is to be drawn now; of several, the one that was drawn longest ago.
  std::optional<MapKind> due(Clock::time_point now) const;
  void put(MapKind kind, MapPicture picture, Clock::time_point now);
  /// There is nothing to draw it from.
  void skip(MapKind kind, Clock::time_point now);

 private:
  struct Entry {
    Clock::time_point asked{}, drawn{};
    std::optional<MapPicture> newest;
  };

  mutable std::mutex mutex_;
  std::array<Entry, kAllMaps.size()> entries_;
};

}  // namespace lumigraft::server
