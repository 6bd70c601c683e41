#pragma once
// Albedo of surface samples by Ceres, given the light on them.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

struct SampleLight {
  Eigen::Vector3f irradiance;  ///< modelled
  float relative_sigma = 0;    ///< 1σ over irradiance: model error, shadow edges
};

/// Minimises robust (π B - a E) / σ over all samples, a in [0, 1], plus smoothness between neighbours without an edge
/// between them. E and B are absolute, so no albedo is fixed. `noise_floor`: noise_floor_radiance. The last held.size()
/// samples keep the albedo `held` and support their neighbours.
std::vector<SampleAlbedo> solve_albedo(const std::vector<SurfaceSample>& samples, const std::vector<SampleLight>& light,
                                       const std::vector<std::vector<int>>& neighbours, float noise_floor,
                                       const std::vector<SampleAlbedo>& held = {});

/// 1σ of a sample's albedo by smoothing: from the difference of what was solved and measured.
float misfit_sigma(const SurfaceSample& sample, const SampleLight& light, const Eigen::Vector3f& albedo,
                   float noise_floor);
/// Fraction of the variance of the sample's measurement that noise causes, not the model of light.
float noise_in_data(const SurfaceSample& sample, const SampleLight& light, float noise_floor);

}  // namespace lumigraft::reconstruct
