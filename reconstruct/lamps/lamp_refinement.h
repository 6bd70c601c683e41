#pragma once
// Local refinement of lamp distances, normals and gains with Ceres.
#include <vector>

#include "reconstruct/lamps/parameters.h"
#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/lamps/shading_model.h"

namespace lumigraft::reconstruct {

struct Refinement {
  std::vector<LampShape> shapes;
  std::vector<double> log_sigma;       ///< 1σ of each lamp's log distance
  std::vector<double> gain_log_sigma;  ///< of its log gain, RMS of the channels; if clipped
  Eigen::MatrixXd covariance;          ///< of all unknowns, kUnknownsPerLamp per lamp
  double cost = 0;                     ///< robust_cost plus albedo_scale_cost at the end
  double pair_variance = 1;            ///< of r (below), inflated as pairs are correlated
};

/// Σ a r² / (a + r²) over pairs, r = Δ log albedo / pair_scale, RMS over channels (Geman and McClure 1985). The cost is
/// bounded: pairs of differently coloured surfaces say nothing about the light, however many there are. The search uses
/// a wide level a, the last refinement a = 1 (graduated non-convexity, Blake and Zisserman 1987).
double robust_cost(const std::vector<Eigen::Array3f>& log_albedo, const std::vector<SamplePair>& pairs,
                   double level = kLampParameters.refinement.wide_level);

/// Prior of the scale of albedo, for lamps of unknown power: white paper or, loosely, the mean of a room.
struct AlbedoScalePrior {
  int paper;                 ///< index of the sample that is paper, or -1: the mean of all samples
  double albedo, log_sigma;  ///< log_sigma: 1σ of log albedo
};
AlbedoScalePrior albedo_scale_prior(int paper);

/// Whether a lamp is clipped in the fish-eye image.
bool has_clipped(const ShadingModel& model);
/// Whether the prior is used. If all visible lamps are measured, the mean of a room does not help to find the power of
/// unseen lamps; paper does.
bool needs_albedo_scale_prior(const ShadingModel& model, int paper);

/// scale_pairs / 3 · Σ over channels ((log albedo of the reference - log albedo of the prior) / σ)².
double albedo_scale_cost(const ShadingModel& model, const std::vector<Eigen::Array3f>& log_albedo, int paper);

/// `paper`: index of the sample that is paper, or -1. Lamps placed by a tag stay there. Gains of clipped lamps are
/// unknowns, at least 1.
Refinement refine_lamps(const ShadingModel& model, const std::vector<SamplePair>& pairs, int paper,
                        const std::vector<LampShape>& start, Search how);

}  // namespace lumigraft::reconstruct
