#pragma once
// Posterior of the lamps' unknowns, given the shading of the room (docs/light_posterior.md):
//
//   -log p = 1/2v Σ ρ(|Δ log albedo|² / s²) + ½ Σ (linear prior rows / σ)²
//
// over pairs of samples, ρ robust, v the variance of a pair in units of s², times the number of pairs that share one
// error. Cost and covariance follow from the same rows.
#include <Eigen/Core>
#include <limits>
#include <vector>

#include "reconstruct/lamps/lamp_prior_rows.h"
#include "reconstruct/lamps/parameters.h"
#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/lamps/shading_model.h"

namespace lumigraft::reconstruct {

/// Σ a r² / (a + r²) over pairs, r = Δ log albedo / pair_scale, RMS over channels (Geman and McClure 1985). The cost is
/// bounded: pairs of differently coloured surfaces say nothing about the light, however many there are. The search uses
/// a wide level a, the last solution a = 1 (graduated non-convexity, Blake and Zisserman 1987). The sum ends above
/// `limit`.
double robust_cost(const std::vector<Eigen::Array3f>& log_albedo, const std::vector<SamplePair>& pairs,
                   double level = kLampParameters.posterior.wide_level,
                   double limit = std::numeric_limits<double>::infinity());

struct LampPosterior {
  std::vector<LampShape> shapes;
  Eigen::MatrixXd information;  ///< inverse covariance of all unknowns, of this solution's own rows
  Eigen::MatrixXd covariance;   ///< its inverse
  Eigen::MatrixXd with_prior;   ///< information, with that of the LampPrior
  double pair_variance = 1;     ///< v
  double misfit = 0;            ///< RMS difference of log albedo of the pairs that agree
  double cost = 0;              ///< in pairs, to compare solutions: 2v (-log p), ρ of the wide level

  double inverse_distance_sigma(std::size_t lamp) const;  ///< 1σ, 1/m
  /// Log of the prior probability that the lamp's distance lies where the solution found it, over that of an infinitely
  /// far lamp (Laplace's method: MacKay 2003, section 28.1).
  double log_ceiling_prior(const PointLight& light, std::size_t lamp) const;
  double gain_log_sigma(std::size_t lamp) const;  ///< 1σ of log gain, RMS of the channels
};

/// `paper`: index of the sample that is white paper, or -1: then, if lamps are clipped, the mean of a room determines
/// the scale of albedo loosely. Lamps placed by a tag stay there. Gains of clipped lamps are unknowns, at least 1.
LampPosterior solve_lamps(const ShadingModel& model, const std::vector<SamplePair>& pairs, int paper,
                          const std::vector<LampShape>& start, Search how, const LampPrior* prior = nullptr);

/// Whether a visible lamp is clipped in the fish-eye image.
bool has_clipped(const ShadingModel& model);
/// Squared residuals of the prior of the albedo scale, over v; 0 where lamps of known power determine it.
double albedo_scale_cost(const ShadingModel& model, const std::vector<Eigen::Array3f>& log_albedo, int paper);

}  // namespace lumigraft::reconstruct
