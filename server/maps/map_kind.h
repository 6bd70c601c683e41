#pragma once
// Maps of the reconstructed scene and of the change of light: their names in requests.
#include <array>
#include <optional>
#include <string_view>

namespace lumigraft::server {

enum class MapKind {
  before_after,  ///< the camera's picture, and beside it the same with objects; twice as wide
  change,        ///< what was added (bright) and taken away (dark), around mid grey
  shadow,        ///< where light was taken away: white is all of it left
  depth,         ///< distance of the reconstructed surface
  surface,       ///< its direction
  albedo,        ///< its colour, without the light on it
  lamps          ///< where the lamps are, over the camera's picture
};
inline constexpr std::array kAllMaps = {MapKind::before_after, MapKind::change, MapKind::shadow, MapKind::depth,
                                        MapKind::surface,      MapKind::albedo, MapKind::lamps};

std::string_view name_of(MapKind kind);
std::optional<MapKind> map_named(std::string_view name);

}  // namespace lumigraft::server
