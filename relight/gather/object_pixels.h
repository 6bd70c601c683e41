#pragma once
// Radiance and coverage of the objects in the camera view.
#include "relight/compose/current_depth.h"
#include "relight/compose/object_layer.h"
#include "relight/gather/ray_shadows.h"
#include "relight/gather_quality.h"

namespace lumigraft::relight {

/// In the smallest window that contains all pixels showing objects. `radiance` is L_ρ.
struct ObjectPixels : ObjectLayer {
  std::vector<GBufferPixel> surfaces;  ///< object surface at each pixel's first ray
};

/// `sources`: see light_sources. Where `depth` is clearly before or behind an object, the fused room does not hide it:
/// what is before it is left to foreground_matte.h. `seen`: the camera's picture, of which transmissive objects show
/// parts. `step_radiance`: noise of what objects mirror that needs no
/// further rays, W/sr/m². `last`: an earlier frame's result, whose memory is reused.
ObjectPixels trace_objects(const DeltaLight& light, const std::vector<const LightSource*>& sources,
                           const RoomPixels& room, const CameraRays& eye, const CurrentDepth& depth,
                           const SeenRadiance& seen, const GatherQuality& detail, float step_radiance,
                           ObjectPixels last);

}  // namespace lumigraft::relight
