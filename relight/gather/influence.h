#pragma once
// Where objects may change a picture visibly, found by one pixel of each tile: the others of it are the camera's own.
#include <cstdint>
#include <vector>

#include "capture/image.h"
#include "relight/gather/delta_light.h"
#include "relight/gather/gbuffer.h"
#include "relight/gather/irradiance_change_cache.h"
#include "relight/gather_quality.h"

namespace lumigraft::relight {

/// Tiles in which the change of light may be half a step of an 8-bit picture or more, of less than which its codes show
/// nothing, and those next to them; of glossy surfaces all. Bounded from above: an object hides a lamp wherever its
/// bounding sphere may. Tiles that show no fused surface count as those around
/// them: they may get their planes (fill_holes). `cells`: indirect light. `codes`: the camera's picture, sRGB.
TileMask influenced_tiles(const DeltaLight& light, const IrradianceChangeCache& cells,
                          const std::vector<LightSampleSet>& lamps, const TilePixels& tiles,
                          const capture::Image<std::uint8_t>& codes, const GatherQuality& detail);

/// Adds the tiles that may show objects.
void add_object_tiles(const std::vector<Eigen::Vector4f>& spheres, const CameraRays& eye, TileMask& tiles);

}  // namespace lumigraft::relight
