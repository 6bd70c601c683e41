#pragma once
// Camera picture plus light, where all comparators meet: what differs between them is how they come by that light.
#include <cstdint>
#include <optional>

#include "capture/image.h"
#include "relight/reference/delta_path_tracer.h"
#include "relight/tracing/world.h"

namespace lumigraft::comparators {

/// Unit, in the tag frame, through a point of the picture, if the camera has a ray there.
std::optional<Eigen::Vector3f> ray_through(const ReferenceCamera& camera, double u, double v);

/// Share of each pixel that objects cover, of 16 rays.
Image<float> object_coverage(const reference::TraceWorld& world, const ReferenceCamera& camera);

/// Differential rendering (Debevec 1998, eq. 3): what is added to (1 - coverage) of the camera's light. Pictures of
/// the whole scene with objects and without.
Image<float> difference(const Image<float>& with, const Image<float>& without, const Image<float>& coverage);

/// 8-bit sRGB of (1 - coverage) of the camera's light plus `exposure` times `added`. Unchanged light keeps its codes.
Image<std::uint8_t> composed(const Image<std::uint8_t>& camera_srgb, const Image<float>& added,
                             const Image<float>& coverage, float exposure);

}  // namespace lumigraft::comparators
