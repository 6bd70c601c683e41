#pragma once
// Distances and normals of lamps by Ceres, from a start that is near.
#include <vector>

#include "reconstruct/albedo_pairs.h"
#include "reconstruct/albedo_shading.h"

namespace lumigraft {

struct Refinement {
  std::vector<LampShape> shapes;
  std::vector<double> log_sigma;  ///< 1σ of each lamp's log distance
  double cost = 0;                ///< robust_cost at the end
};

/// Difference of log albedo, RMS over channels, that counts as large: textures vary by about so much.
constexpr double kPairScale = 0.1;

/// Σ log(1 + (Δ / kPairScale)²) over pairs (Cauchy).
double robust_cost(const std::vector<Eigen::Array3f>& log_albedo, const std::vector<SamplePair>& pairs);

Refinement refine_lamps(const ShadingModel& model, const std::vector<SamplePair>& pairs,
                        const std::vector<LampShape>& start);

}  // namespace lumigraft
