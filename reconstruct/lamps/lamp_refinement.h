#pragma once
// Distances and normals of lamps by Ceres, from a start that is near.
#include <vector>

#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/lamps/shading_model.h"

namespace lumigraft::reconstruct {

struct Refinement {
  std::vector<LampShape> shapes;
  std::vector<double> log_sigma;       ///< 1σ of each lamp's log distance
  std::vector<double> gain_log_sigma;  ///< and of its log gain, RMS of the channels; where it is clipped
  Eigen::MatrixXd covariance;          ///< of all of it: kPerLamp for each lamp
  double cost = 0;                     ///< robust_cost at the end, and that of the gauge
  double pair_variance = 1;            ///< of r as below, so large that all pairs together tell what they know
};

/// Difference of log albedo, RMS over channels, that counts as large: textures vary by about so much.
constexpr double kPairScale = 0.1;

/// Σ a r² / (a + r²) over pairs, r = Δ / kPairScale (Geman and McClure 1985). It levels out: that one surface is
/// another colour than the next says nothing about the light, however many such pairs there are. The search goes by a
/// wide level a, kWideLevel, and ends with a = 1 (graduated non-convexity, Blake and Zisserman 1987).
constexpr double kWideLevel = 4;
double robust_cost(const std::vector<Eigen::Array3f>& log_albedo, const std::vector<SamplePair>& pairs,
                   double level = kWideLevel);

/// What holds the scale of albedo where a lamp's power is unknown: white paper, or, loosely, what rooms usually are.
struct AlbedoScalePrior {
  int paper;             ///< index of the sample that is paper, or -1: the mean of all others
  double albedo, sigma;  ///< the second of its logarithm
};
AlbedoScalePrior gauge_of(int paper);

/// Whether a lamp is clipped in the fish-eye's picture.
bool has_clipped(const ShadingModel& model);
/// Whether a gauge is needed. Where all that is seen is measured, what rooms usually are says nothing of a lamp that is
/// not seen; paper does.
bool has_gauge(const ShadingModel& model, int paper);

/// Σ over channels ((gauged log albedo - log albedo of the gauge) / σ)², as strong as kGaugePairs pairs.
double gauge_cost(const ShadingModel& model, const std::vector<Eigen::Array3f>& log_albedo, int paper);
constexpr double kGaugePairs = 300;

/// Log gain of a lamp that nobody sees, with which it would be dim but matter. One that is found to send less is as
/// sure as if it sent that: nothing and next to nothing differ by much in logarithm alone.
constexpr double kLogDim = 3.4;

/// `paper` is the index of the sample that is paper, or -1. Lamps that are placed stay there. Gains of clipped lamps
/// are unknowns too, at least 1.
Refinement refine_lamps(const ShadingModel& model, const std::vector<SamplePair>& pairs, int paper,
                        const std::vector<LampShape>& start, Search how);

}  // namespace lumigraft::reconstruct
