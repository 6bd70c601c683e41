#pragma once
// Shadows at pixels: fans of rays to each lamp, smoothed within its penumbra. 4 × 4 pixels share the points of a lamp,
// which are even over it. Where pixels some way apart all around find a lamp open, or all of it hidden, those between
// find the same and send no rays.
#include "relight/gather/delta_light.h"
#include "relight/gather/gather_quality.h"
#include "relight/gather/gbuffer.h"
#include "relight/gather/light_samples.h"

namespace lumigraft::relight {

/// For each lamp of the room.
std::vector<LightSampleSet> light_samples_of(const RayRoom& room);

/// By pixel, of three channels, irradiance of all lamps that objects hide from even real surfaces, W/m². What is
/// narrower than detail.step may be missed.
std::vector<Eigen::Array4f> hidden_by_objects(const DeltaLight& light, const std::vector<LightSampleSet>& lamps,
                                              const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera,
                                              const GatherQuality& detail);

struct LampVisibility {
  float open = 1;          ///< the share of a lamp's light that comes past room and objects
  bool holds_near = true;  ///< across the pixel: shadows around there are wider than that, or there are none
};
/// By lamp and pixel of an object.
std::vector<std::vector<LampVisibility>> open_to_lamps(const DeltaLight& light,
                                                       const std::vector<LightSampleSet>& lamps,
                                                       const std::vector<GBufferPixel>& seen,
                                                       const capture::CameraModel& camera, const GatherQuality& detail);

}  // namespace lumigraft::relight
