#include "reconstruct/exposure/dimming.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/exposure/parameters.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

/// Places of one channel: a row of parts each, and what is seen.
struct Rows {
  Eigen::MatrixXf parts;
  Eigen::VectorXf ratio;
  std::vector<bool> dark;

  float error(Eigen::Index i, float predicted) const {
    const float log_error = std::log(ratio[i] / std::max(predicted, 1e-9f));
    return dark[static_cast<std::size_t>(i)] ? std::min(log_error, 0.0f) : log_error;
  }
};

/// min xᵀ A x / 2 - bᵀ x over x >= 0, by coordinate descent (Franc, Hlaváč and Navara 2005).
void descend(const Eigen::MatrixXf& a, const Eigen::VectorXf& b, Eigen::VectorXf& x) {
  for (int round = 0; round < kExposure.dimming_rounds; ++round)
    for (Eigen::Index k = 0; k < x.size(); ++k) x[k] = std::max(0.0f, x[k] + (b[k] - a.row(k).dot(x)) / a(k, k));
}

Eigen::VectorXf powers(const Rows& rows) {
  std::vector<float> ratios(rows.ratio.begin(), rows.ratio.end());
  const float middle = median(ratios);
  Eigen::VectorXf s = Eigen::VectorXf::Constant(rows.parts.cols(), middle);
  const float sigma = kExposure.texture_log_sigma;
  for (int round = 0; round < kExposure.dimming_rounds; ++round) {
    const Eigen::VectorXf predicted = rows.parts * s;
    Eigen::VectorXf weights(predicted.size());
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
      const float error = rows.error(i, predicted[i]), slope = std::max(predicted[i], middle * sigma);
      const bool satisfied = rows.dark[static_cast<std::size_t>(i)] && error == 0;
      weights[i] = satisfied
                       ? 0
                       : 1 / (sigma * std::max(std::abs(error), sigma) * slope * slope * kExposure.independent_matches);
    }
    const float prior = 1 / (middle * middle);  // a lamp may be off or twice as bright
    Eigen::MatrixXf a = rows.parts.transpose() * weights.asDiagonal() * rows.parts;
    a.diagonal().array() += prior;
    const Eigen::VectorXf b = (rows.parts.transpose() * weights.asDiagonal() * rows.ratio).array() + prior * middle;
    descend(a, b, s);
  }
  return s;
}

}  // namespace

std::optional<Dimming> fit_dimming(const std::vector<DimmedPlace>& places, const Illumination& light) {
  if (places.size() < kExposure.min_matches) return std::nullopt;
  Dimming result{.since_ns = light.time_ns, .lamps = {}, .environment = {}};
  const auto count = static_cast<Eigen::Index>(places.size());
  const auto lamps = static_cast<Eigen::Index>(light.lights.size());
  for (int c = 0; c < 3; ++c) {
    Rows rows{Eigen::MatrixXf(count, lamps + 1), Eigen::VectorXf(count), {}};
    for (Eigen::Index i = 0; i < count; ++i) {
      const DimmedPlace& place = places[static_cast<std::size_t>(i)];
      for (Eigen::Index k = 0; k <= lamps; ++k) rows.parts(i, k) = place.parts[static_cast<std::size_t>(k)][c];
      rows.ratio[i] = place.ratio[c];
      rows.dark.push_back(place.dark);
    }
    const Eigen::VectorXf s = powers(rows), predicted = rows.parts * s;
    Eigen::Index agree = 0;
    for (Eigen::Index i = 0; i < count; ++i) agree += std::abs(rows.error(i, predicted[i])) < kExposure.inlier_log;
    if (static_cast<float>(agree) < kExposure.min_inlier_fraction * static_cast<float>(count)) return std::nullopt;
    for (Eigen::Index k = 0; k < lamps; ++k) result.lamps[light.lights[static_cast<std::size_t>(k)].id][c] = s[k];
    result.environment[c] = s[lamps];
  }
  return result;
}

}  // namespace lumigraft::reconstruct
