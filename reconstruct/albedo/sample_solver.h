#pragma once
// Albedo of surface samples by Ceres, given the light on them.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

struct SampleLight {
  Eigen::Vector3f irradiance;  ///< modelled
  float sigma_share = 0;       ///< 1σ of it over itself: model error, shadow edges
};

struct SampleAlbedo {
  Eigen::Vector3f albedo;
  float sigma = -1;  ///< 1σ, mean of the channels; negative = unknown
};

/// Neighbours of every sample: the nearest ones of similar orientation.
std::vector<std::vector<int>> neighbours(const std::vector<SurfaceSample>& samples, float reach_cells);

/// Minimises robust (π B - a E) / σ over all samples, a in [0, 1], plus smoothness between neighbours where the picture
/// shows no edge. Gauge: none is needed, E and B are absolute. `dark` is the radiance below which a code says nothing.
/// The last samples, as many as `held`, keep the albedo that these give, and support their neighbours.
std::vector<SampleAlbedo> solve_albedo(const std::vector<SurfaceSample>& samples, const std::vector<SampleLight>& light,
                                       const std::vector<std::vector<int>>& neighbours, float dark,
                                       const std::vector<SampleAlbedo>& held = {});

}  // namespace lumigraft::reconstruct
