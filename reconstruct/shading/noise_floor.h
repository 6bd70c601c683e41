#pragma once
// Where a picture is too dark to tell: what an 8-bit picture's darkest codes hold is as good as black.
#include <Eigen/Core>
#include <numbers>
#include <vector>

#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// Radiance that counts as black: a share of the samples' mean.
float dark_radiance(const std::vector<SurfaceSample>& samples);

/// π B / E of a matt surface. Where little light falls, and the picture is as dark, it says white: nothing is known.
inline Eigen::Array3f matt_albedo(const Eigen::Vector3f& radiance, const Eigen::Vector3f& irradiance, float dark) {
  constexpr float kPi = std::numbers::pi_v<float>;
  return kPi * (radiance.array() + dark) / (irradiance.array() + kPi * dark);
}

/// 1σ of π B that is due to darkness.
inline float dark_sigma(float dark) { return 0.5f * std::numbers::pi_v<float> * dark; }

}  // namespace lumigraft::reconstruct
