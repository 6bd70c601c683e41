#pragma once
// Radiance and albedo of pixels in which the camera clips.
#include <vector>

#include "relight/gather/gbuffer.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/tracing/light_samples.h"

namespace lumigraft::relight {

/// A clipped channel is a lower bound of the radiance (Tobin 1958): it becomes that of the room's albedo under
/// unoccluded lamps and the environment, where that is more; elsewhere the albedo becomes what explains the bound.
/// Where some channels clip, the others show by which factor that differs from the pixel; it holds for all of them, and
/// for pixels around in which all clip. `radiance`: of the camera's image, W/sr/m²; of other surfaces than matt ones it
/// stays. Returns whether a pixel clips.
bool restore_clipped(const reconstruct::Illumination& light, const std::vector<LightSampleSet>& lamps,
                     const CameraUpload& camera, std::vector<GBufferPixel>& seen, capture::Image<float>& radiance);

}  // namespace lumigraft::relight
