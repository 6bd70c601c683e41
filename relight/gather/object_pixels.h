#pragma once
// Radiance and coverage of the objects in the camera view.
#include "relight/compose/current_depth.h"
#include "relight/compose/object_layer.h"
#include "relight/gather/ray_shadows.h"
#include "relight/gather_quality.h"

namespace lumigraft::relight {

/// The room's G-buffer of a view in which a pixel stands for a square of scale × scale pixels of the camera.
struct RoomPixels {
  const std::vector<GBufferPixel>& seen;
  const capture::CameraModel& camera;  ///< of that view
  int scale;

  const GBufferPixel& at(int u, int v) const {  ///< at a pixel of the camera
    return seen[static_cast<std::size_t>(v / scale) * static_cast<std::size_t>(camera.width) +
                static_cast<std::size_t>(u / scale)];
  }
};

/// In the smallest window that contains all pixels showing objects. `radiance` is L_ρ.
struct ObjectPixels : ObjectLayer {
  std::vector<GBufferPixel> surfaces;  ///< object surface at each pixel's first ray
};

/// `sources`: see light_sources. `room`: of the same camera. Where `depth` is clearly
/// before or behind an object, the fused room does not hide it: what is before it is left to foreground_matte.h.
/// `seen`: the camera's
/// picture, of which transmissive objects show parts. `step_radiance`: noise of what objects mirror that needs no
/// further rays, W/sr/m². `last`: an earlier frame's result, whose memory is reused.
ObjectPixels trace_objects(const DeltaLight& light, const std::vector<const LightSource*>& sources,
                           const RoomPixels& room, const CameraRays& eye, const CurrentDepth& depth,
                           const SeenRadiance& seen, const GatherQuality& detail, float step_radiance,
                           ObjectPixels last);

}  // namespace lumigraft::relight
