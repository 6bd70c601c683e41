#pragma once
// Camera picture plus light, where all comparators meet: what differs between them is how they come by that light.
#include <cstdint>
#include <optional>

#include "capture/image.h"
#include "relight/reference/delta_path_tracer.h"
#include "relight/tracing/world.h"

namespace lumigraft::comparators {

/// Unit, in the tag frame, through a point of the picture, if the camera has a ray there.
std::optional<Eigen::Vector3f> ray_through(const relight::PosedCamera& camera, double u, double v);

/// Share of each pixel that objects cover, of 16 rays.
capture::Image<float> object_coverage(const relight::TraceWorld& world, const relight::PosedCamera& camera);

/// Differential rendering (Debevec 1998, eq. 3): what is added to (1 - coverage) of the camera's light. Pictures of
/// the whole scene with objects and without.
capture::Image<float> difference(const capture::Image<float>& with, const capture::Image<float>& without,
                                 const capture::Image<float>& coverage);

/// 8-bit sRGB of (1 - coverage) of the camera's light plus `exposure` times `added`. Unchanged light keeps its codes.
capture::Image<std::uint8_t> composed(const capture::Image<std::uint8_t>& camera_srgb,
                                      const capture::Image<float>& added, const capture::Image<float>& coverage,
                                      float exposure);

}  // namespace lumigraft::comparators
