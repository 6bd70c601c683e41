#include "reconstruct/lamps/lamp_filter.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "reconstruct/lamps/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Filter& kFilter = kLampParameters.filter;

using Block = Eigen::Matrix<double, kUnknownsPerLamp, kUnknownsPerLamp>;

Eigen::MatrixXd chosen(const Eigen::MatrixXd& matrix, const std::vector<Eigen::Index>& lamps) {
  const auto count = static_cast<Eigen::Index>(lamps.size());
  Eigen::MatrixXd result(kUnknownsPerLamp * count, kUnknownsPerLamp * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      result.block<kUnknownsPerLamp, kUnknownsPerLamp>(kUnknownsPerLamp * i, kUnknownsPerLamp * j) =
          matrix.block<kUnknownsPerLamp, kUnknownsPerLamp>(kUnknownsPerLamp * lamps[static_cast<std::size_t>(i)],
                                                           kUnknownsPerLamp * lamps[static_cast<std::size_t>(j)]);
    }
  }
  return result;
}

/// Adds the information of the lamps at `indices`, weight · covariance⁻¹, and its product with their values.
void add(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& values, const std::vector<Eigen::Index>& indices,
         double weight, Eigen::MatrixXd& information, Eigen::VectorXd& product) {
  if (indices.empty()) return;
  const Eigen::MatrixXd own = weight * covariance.inverse();
  const Eigen::VectorXd weighted = own * values;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(kUnknownsPerLamp * i);
    product.segment<kUnknownsPerLamp>(kUnknownsPerLamp * indices[i]) += weighted.segment<kUnknownsPerLamp>(row);
    for (std::size_t j = 0; j < indices.size(); ++j) {
      information.block<kUnknownsPerLamp, kUnknownsPerLamp>(kUnknownsPerLamp * indices[i],
                                                            kUnknownsPerLamp * indices[j]) +=
          own.block<kUnknownsPerLamp, kUnknownsPerLamp>(row, static_cast<Eigen::Index>(kUnknownsPerLamp * j));
    }
  }
}

std::array<Eigen::Vector3f, 2> axes_across(const Eigen::Vector3f& direction) {
  const Eigen::Vector3f first = direction.unitOrthogonal();
  return {first, direction.cross(first)};
}

bool far_apart(const Eigen::Matrix<double, kUnknownsPerLamp, 1>& difference, const Block& covariance) {
  return difference.dot(covariance.inverse() * difference) > kFilter.contradiction;
}

}  // namespace

LampFilter::Parameters LampFilter::parameters(const Track& track, const PointLight& light,
                                              const LampEstimate& estimate) {
  Parameters result = Parameters::Zero();
  result[0] = std::log(estimate.distance_m);
  if (estimate.flat) {
    const float along = std::max(-estimate.normal.dot(light.direction), kMinSlantCosine);
    for (Eigen::Index i = 0; i < 2; ++i)
      result[1 + i] = estimate.normal.dot(track.across[static_cast<std::size_t>(i)]) / along;
  }
  for (Eigen::Index c = 0; c < 3; ++c)
    result[3 + c] = std::log(std::max(light.irradiance[c] * estimate.gain[c], 1e-12f));
  return result;
}

/// Continues the track of a lamp or starts a new one.
void LampFilter::follow(const PointLight& light, const LampEstimate& estimate, const Eigen::MatrixXd& before,
                        Step& step) const {
  const auto index = static_cast<Eigen::Index>(step.tracks.size());
  const Block own =
      step.covariance.block<kUnknownsPerLamp, kUnknownsPerLamp>(kUnknownsPerLamp * index, kUnknownsPerLamp * index);
  const Track new_track{light.id,          estimate.flat,   estimate.beam,    estimate.far,
                        light.clipped,     light.direction, light.irradiance, axes_across(light.direction),
                        Parameters::Zero()};
  const auto was = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& t) { return t.id == light.id; });
  bool goes_on =
      was != tracks_.end() && was->clipped == light.clipped &&
      was->direction.dot(light.direction) > kFilter.same_direction &&
      (light.clipped || (was->irradiance - light.irradiance).norm() < kFilter.same_irradiance * was->irradiance.norm());
  Track track = goes_on ? *was : new_track;
  Parameters value = parameters(track, light, estimate);
  bool counts = true;
  if (goes_on) {
    const Eigen::Index from = was - tracks_.begin();
    const Block known =
        before.block<kUnknownsPerLamp, kUnknownsPerLamp>(kUnknownsPerLamp * from, kUnknownsPerLamp * from);
    const Parameters difference = value - mean_.segment<kUnknownsPerLamp>(kUnknownsPerLamp * from);
    const bool contradicts = track.flat != estimate.flat || track.beam != estimate.beam || track.far != estimate.far ||
                             far_apart(difference, known + own);
    if (contradicts && track.contradicted && !far_apart(value - track.last, 2 * own)) {
      goes_on = false;
      track = new_track;
      value = parameters(track, light, estimate);
    } else {
      counts = !contradicts;
      track.contradicted = contradicts;
      step.kept_from.push_back(from);
    }
  }
  track.last = value;
  step.values.segment<kUnknownsPerLamp>(kUnknownsPerLamp * index) = value;
  if (goes_on) step.kept.push_back(index);
  if (counts) step.counted.push_back(index);
  // The solution's tilts are along axes of its own.
  const std::array<Eigen::Vector3f, 2> across = axes_across(light.direction);
  Eigen::Matrix2d turn;
  for (Eigen::Index i = 0; i < 2; ++i)
    for (Eigen::Index j = 0; j < 2; ++j)
      turn(i, j) = track.across[static_cast<std::size_t>(i)].dot(across[static_cast<std::size_t>(j)]);
  const Eigen::Index tilt = kUnknownsPerLamp * index + 1;
  step.covariance.middleRows<2>(tilt) = (turn * step.covariance.middleRows<2>(tilt)).eval();
  step.covariance.middleCols<2>(tilt) = (step.covariance.middleCols<2>(tilt) * turn.transpose()).eval();
  step.tracks.push_back(track);
}

/// Adds faded old information and that of the solution; sets mean_, information_ and solves_.
void LampFilter::fuse(const Eigen::MatrixXd& before, const Step& step) {
  const Eigen::Index size = step.values.size();
  const auto values_at = [](const Eigen::VectorXd& values, const std::vector<Eigen::Index>& indices) {
    Eigen::VectorXd result(static_cast<Eigen::Index>(kUnknownsPerLamp * indices.size()));
    for (std::size_t i = 0; i < indices.size(); ++i)
      result.segment<kUnknownsPerLamp>(static_cast<Eigen::Index>(kUnknownsPerLamp * i)) =
          values.segment<kUnknownsPerLamp>(kUnknownsPerLamp * indices[i]);
    return result;
  };
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd product = Eigen::VectorXd::Zero(size);
  if (!step.kept.empty())
    add(chosen(before, step.kept_from), values_at(mean_, step.kept_from), step.kept, kFilter.kept, information,
        product);
  add(chosen(step.covariance, step.counted), values_at(step.values, step.counted), step.counted, 1, information,
      product);
  information_ = std::move(information);
  const Eigen::MatrixXd after = information_.inverse();
  mean_ = after * product;
  solves_ = step.kept.empty() ? 1 : kFilter.kept * solves_ + 1;
}

LampEstimate LampFilter::report(std::size_t lamp, const PointLight& light, LampEstimate estimate,
                                const Eigen::MatrixXd& covariance) const {
  const auto at = static_cast<Eigen::Index>(kUnknownsPerLamp * lamp);
  const Track& track = tracks_[lamp];
  const float solved_sigma = estimate.log_sigma;
  estimate.distance_m = static_cast<float>(std::exp(mean_[at]));
  estimate.log_sigma = static_cast<float>(std::sqrt(std::max(0.0, solves_ * covariance(at, at))));
  estimate.flat = track.flat;
  if (track.beam) estimate.log_sigma = std::max(estimate.log_sigma, solved_sigma);
  estimate.beam = track.beam;
  estimate.far = track.far;
  if (track.flat) {
    estimate.normal = (-light.direction + static_cast<float>(mean_[at + 1]) * track.across[0] +
                       static_cast<float>(mean_[at + 2]) * track.across[1])
                          .normalized();
  }
  if (!track.clipped) return estimate;
  for (Eigen::Index c = 0; c < 3; ++c) {
    const double gain = std::exp(mean_[at + 3 + c]) / std::max(light.irradiance[c], 1e-12f);
    estimate.gain[c] = static_cast<float>(std::max(gain, 1.0));
  }
  const double variance = solves_ * covariance.diagonal().segment<3>(at + 3).mean();
  estimate.gain_log_sigma = static_cast<float>(std::sqrt(std::max(0.0, variance)));
  return estimate;
}

std::vector<LampEstimate> LampFilter::combine(const std::vector<PointLight>& lights, const LampSolution& now) {
  const Eigen::MatrixXd before = information_.size() > 0 ? Eigen::MatrixXd(information_.inverse()) : Eigen::MatrixXd();
  Step step;
  step.covariance = now.covariance;
  step.values.resize(static_cast<Eigen::Index>(kUnknownsPerLamp * lights.size()));
  for (std::size_t lamp = 0; lamp < lights.size(); ++lamp) follow(lights[lamp], now.lamps[lamp], before, step);
  fuse(before, step);
  tracks_ = std::move(step.tracks);
  const Eigen::MatrixXd after = information_.inverse();
  std::vector<LampEstimate> result;
  for (std::size_t lamp = 0; lamp < lights.size(); ++lamp)
    result.push_back(report(lamp, lights[lamp], now.lamps[lamp], after));
  return result;
}

}  // namespace lumigraft::reconstruct
