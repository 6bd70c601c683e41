#pragma once
// Compositing of the camera picture with added light, shared by all comparators; they differ only in how that light is
// computed.
#include <cstdint>
#include <optional>

#include "capture/image.h"
#include "relight/reference/delta_path_tracer.h"
#include "relight/tracing/world.h"

namespace lumigraft::comparators {

/// Unit ray direction in the tag frame through a point of the picture; empty outside the field of view.
std::optional<Eigen::Vector3f> ray_through(const relight::PosedCamera& camera, double u, double v);

/// Fraction of each pixel covered by objects, from 16 rays.
capture::Image<float> object_coverage(const relight::TraceWorld& world, const relight::PosedCamera& camera);

/// Differential rendering (Debevec 1998, eq. 3): the light to add to (1 - coverage) of the camera's light, from
/// pictures of the whole scene with and without objects.
capture::Image<float> difference(const capture::Image<float>& with, const capture::Image<float>& without,
                                 const capture::Image<float>& coverage);

/// 8-bit sRGB of (1 - coverage) of the camera's light plus `exposure` times `added`. Where the light does not change,
/// pixel values stay exact.
capture::Image<std::uint8_t> composed(const capture::Image<std::uint8_t>& camera_srgb,
                                      const capture::Image<float>& added, const capture::Image<float>& coverage,
                                      float exposure);

}  // namespace lumigraft::comparators
