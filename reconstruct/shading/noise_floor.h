#pragma once
// Noise floor of radiance: the darkest values of an 8-bit image are indistinguishable from black.
#include <Eigen/Core>
#include <algorithm>
#include <numbers>
#include <vector>

#include "reconstruct/shading/parameters.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// Radiance that counts as black: a fraction of the samples' mean.
inline float noise_floor_radiance(const std::vector<SurfaceSample>& samples) {
  constexpr float kRatio = kShadingParameters.noise_floor_ratio, kMin = kShadingParameters.min_noise_floor;
  double sum = 0;
  for (const SurfaceSample& sample : samples) sum += sample.radiance.mean();
  return samples.empty() ? kMin : std::max(kMin, kRatio * static_cast<float>(sum / samples.size()));
}

/// Albedo π B / E of a diffuse surface. It tends to 1 where B and E are below the noise floor: nothing is known there.
inline Eigen::Array3f lambertian_albedo(const Eigen::Vector3f& radiance, const Eigen::Vector3f& irradiance,
                                        float noise_floor) {
  constexpr float pi = std::numbers::pi_v<float>;
  return pi * (radiance.array() + noise_floor) / (irradiance.array() + pi * noise_floor);
}

/// 1σ of π B from the noise floor.
inline float noise_floor_sigma(float noise_floor) { return 0.5f * std::numbers::pi_v<float> * noise_floor; }

}  // namespace lumigraft::reconstruct
