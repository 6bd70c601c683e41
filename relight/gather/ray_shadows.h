#pragma once
// Shadows at pixels: packets of shadow rays to each lamp, and to each object that emits light, filtered within its
// penumbra. 4 × 4 pixels share stratified sample points of it. Where sparse pixels all around find a lamp fully visible
// or fully occluded, the pixels between take that value without sending rays.
#include "relight/gather/delta_light.h"
#include "relight/gather/gbuffer.h"
#include "relight/gather_quality.h"
#include "relight/tracing/emitter_samples.h"

namespace lumigraft::relight {

/// For each lamp of the room.
std::vector<LightSampleSet> light_samples_of(const RayRoom& room);

/// Per pixel, three channels: irradiance of all lamps that objects occlude on matt real surfaces, W/m². Shadows
/// narrower than the quality's `step` may be missed.
std::vector<Eigen::Array4f> hidden_by_objects(const DeltaLight& light, const std::vector<LightSampleSet>& lamps,
                                              const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera,
                                              const GatherQuality& detail);

/// Likewise, what objects that emit light add.
std::vector<Eigen::Array4f> lit_by_objects(const DeltaLight& light, const std::vector<EmitterSampleSet>& emitters,
                                           const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera,
                                           const GatherQuality& detail);

struct LampVisibility {
  float open = 1;          ///< fraction of a source's light that neither room nor objects occlude
  bool holds_near = true;  ///< constant over the pixel: shadows nearby are wider than it, or there are none
};
/// What lights objects: the lamps of the room, then objects that emit.
std::vector<const LightSource*> light_sources(const std::vector<LightSampleSet>& lamps,
                                              const std::vector<EmitterSampleSet>& emitters);
/// By source and pixel of an object.
std::vector<std::vector<LampVisibility>> open_to_lamps(const DeltaLight& light,
                                                       const std::vector<const LightSource*>& sources,
                                                       const std::vector<GBufferPixel>& seen,
                                                       const capture::CameraModel& camera, const GatherQuality& detail);

}  // namespace lumigraft::relight
