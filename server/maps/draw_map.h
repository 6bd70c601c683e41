#pragma once
// Draws a map as a picture of the colour camera's size.
#include <optional>

#include "capture/image.h"
#include "reconstruct/scene.h"
#include "server/maps/map_kind.h"
#include "server/maps/seen_surface.h"

namespace lumigraft::server {

/// A picture and what it was made of.
struct MapSource {
  capture::Image<std::uint8_t> camera;                        ///< sRGB, as it came
  std::shared_ptr<const capture::Image<std::uint8_t>> shown;  ///< of the same size, with objects
  reconstruct::Scene scene;                                   ///< of that moment, with its pose if it is known
  capture::CameraModel lens;
};

/// Empty where what it shows is not known yet: depth, surface, albedo and lamps need a pose, and what they show.
/// `surface` is brought up to date if it is needed.
///
/// change: 128 + 2 (shown - camera), pixel values. shadow: ratio of linear luminances, at most 1, as sRGB. depth: from
/// red at 0.3 m over green to blue at 8 m, logarithmic. surface: 0.5 (n + 1) of the normal n in the tag's frame.
/// albedo: as sRGB. Black where no surface is known, dark grey where its albedo is not.
std::optional<capture::Image<std::uint8_t>> draw_map(MapKind kind, const MapSource& source, SeenSurface& surface);

}  // namespace lumigraft::server
