#include "server/maps/map_kind.h"

#include <algorithm>

namespace lumigraft::server {

std::string_view name_of(MapKind kind) {
  constexpr std::array<std::string_view, kAllMaps.size()> kNames = {"before-after", "change", "shadow", "depth",
                                                                    "surface",      "albedo", "lamps"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::optional<MapKind> map_named(std::string_view name) {
  const auto found = std::ranges::find(kAllMaps, name, name_of);
  return found == kAllMaps.end() ? std::nullopt : std::optional(*found);
}

}  // namespace lumigraft::server
