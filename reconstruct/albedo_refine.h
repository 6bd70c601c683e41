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

/// A sample that is known to be white paper.
constexpr double kPaperAlbedo = 0.8;
constexpr double kPaperSigma = 0.15;  ///< of its logarithm

/// Σ over channels ((log albedo - log kPaperAlbedo) / kPaperSigma)², as strong as kPaperPairs pairs.
double paper_cost(const Eigen::Array3f& log_albedo);
constexpr double kPaperPairs = 300;

/// `paper` is the index of the sample that is paper, or -1. Gains of clipped lamps are unknowns too, at least 1.
Refinement refine_lamps(const ShadingModel& model, const std::vector<SamplePair>& pairs, int paper,
                        const std::vector<LampShape>& start);

}  // namespace lumigraft
