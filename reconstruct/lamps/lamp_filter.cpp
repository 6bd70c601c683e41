#include "reconstruct/lamps/lamp_filter.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {
namespace {

constexpr double kKept = 0.75;          ///< of the information of solves before: about four count
constexpr double kContradicts = 22.5;   ///< squared Mahalanobis distance: one in a thousand of six numbers
constexpr float kSameCosine = 0.9999f;  ///< 0.8°
constexpr float kSameShare = 0.2f;      ///< of a measured irradiance

using Block = Eigen::Matrix<double, kPerLamp, kPerLamp>;

Eigen::MatrixXd chosen(const Eigen::MatrixXd& matrix, const std::vector<Eigen::Index>& lamps) {
  const auto count = static_cast<Eigen::Index>(lamps.size());
  Eigen::MatrixXd result(kPerLamp * count, kPerLamp * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      result.block<kPerLamp, kPerLamp>(kPerLamp * i, kPerLamp * j) = matrix.block<kPerLamp, kPerLamp>(
          kPerLamp * lamps[static_cast<std::size_t>(i)], kPerLamp * lamps[static_cast<std::size_t>(j)]);
    }
  }
  return result;
}

/// Adds the information that a covariance of some lamps stands for, and its product with their values.
void add(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& values, const std::vector<Eigen::Index>& places,
         double weight, Eigen::MatrixXd& information, Eigen::VectorXd& product) {
  if (places.empty()) return;
  const Eigen::MatrixXd own = weight * covariance.inverse();
  const Eigen::VectorXd with = own * values;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(kPerLamp * i);
    product.segment<kPerLamp>(kPerLamp * places[i]) += with.segment<kPerLamp>(row);
    for (std::size_t j = 0; j < places.size(); ++j) {
      information.block<kPerLamp, kPerLamp>(kPerLamp * places[i], kPerLamp * places[j]) +=
          own.block<kPerLamp, kPerLamp>(row, static_cast<Eigen::Index>(kPerLamp * j));
    }
  }
}

std::array<Eigen::Vector3f, 2> axes_across(const Eigen::Vector3f& direction) {
  const Eigen::Vector3f first = direction.unitOrthogonal();
  return {first, direction.cross(first)};
}

bool far_apart(const Eigen::Matrix<double, kPerLamp, 1>& difference, const Block& covariance) {
  return difference.dot(covariance.inverse() * difference) > kContradicts;
}

}  // namespace

LampFilter::Parameters LampFilter::parameters(const Track& track, const PointLight& light,
                                              const LampEstimate& estimate) const {
  Parameters result = Parameters::Zero();
  result[0] = std::log(estimate.distance_m);
  if (estimate.flat) {
    const float along = std::max(-estimate.normal.dot(light.direction), kLeastSlant);
    for (Eigen::Index i = 0; i < 2; ++i)
      result[1 + i] = estimate.normal.dot(track.across[static_cast<std::size_t>(i)]) / along;
  }
  for (Eigen::Index c = 0; c < 3; ++c)
    result[3 + c] = std::log(std::max(light.irradiance[c] * estimate.gain[c], 1e-12f));
  return result;
}

std::vector<LampEstimate> LampFilter::combine(const std::vector<PointLight>& lights, const LampSolution& now) {
  const std::size_t count = lights.size();
  const auto size = static_cast<Eigen::Index>(kPerLamp * count);
  const Eigen::MatrixXd before = information_.size() > 0 ? Eigen::MatrixXd(information_.inverse()) : Eigen::MatrixXd();
  Eigen::MatrixXd covariance = now.covariance;
  std::vector<Track> tracks;
  std::vector<Eigen::Index> kept, kept_from,
      told;  // places of lamps that go on, theirs before, and of those that count
  Eigen::VectorXd values(size);
  for (std::size_t k = 0; k < count; ++k) {
    const PointLight& light = lights[k];
    const LampEstimate& estimate = now.lamps[k];
    const auto place = static_cast<Eigen::Index>(k);
    const Block own = covariance.block<kPerLamp, kPerLamp>(kPerLamp * place, kPerLamp * place);
    const Track anew{light.id,          estimate.flat,   estimate.beam,    estimate.far,
                     light.clipped,     light.direction, light.irradiance, axes_across(light.direction),
                     Parameters::Zero()};
    const auto was = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& t) { return t.id == light.id; });
    bool goes_on = was != tracks_.end() && was->clipped == light.clipped &&
                   was->direction.dot(light.direction) > kSameCosine &&
                   (light.clipped || (was->irradiance - light.irradiance).norm() < kSameShare * was->irradiance.norm());
    Track track = goes_on ? *was : anew;
    Parameters value = parameters(track, light, estimate);
    bool counts = true;
    if (goes_on) {
      const Eigen::Index from = was - tracks_.begin();
      const Block known = before.block<kPerLamp, kPerLamp>(kPerLamp * from, kPerLamp * from);
      const Parameters off = value - mean_.segment<kPerLamp>(kPerLamp * from);
      const bool contradicts = track.flat != estimate.flat || track.beam != estimate.beam ||
                               track.far != estimate.far || far_apart(off, known + own);
      if (contradicts && track.contradicted && !far_apart(value - track.last, 2 * own)) {
        goes_on = false;
        track = anew;
        value = parameters(track, light, estimate);
      } else {
        counts = !contradicts;
        track.contradicted = contradicts;
        kept_from.push_back(from);
      }
    }
    track.last = value;
    values.segment<kPerLamp>(kPerLamp * place) = value;
    if (goes_on) kept.push_back(place);
    if (counts) told.push_back(place);
    // Tilts of the solve are along axes of its own.
    const std::array<Eigen::Vector3f, 2> across = axes_across(light.direction);
    Eigen::Matrix2d turn;
    for (Eigen::Index i = 0; i < 2; ++i)
      for (Eigen::Index j = 0; j < 2; ++j)
        turn(i, j) = track.across[static_cast<std::size_t>(i)].dot(across[static_cast<std::size_t>(j)]);
    const Eigen::Index tilt = kPerLamp * place + 1;
    covariance.middleRows<2>(tilt) = (turn * covariance.middleRows<2>(tilt)).eval();
    covariance.middleCols<2>(tilt) = (covariance.middleCols<2>(tilt) * turn.transpose()).eval();
    tracks.push_back(track);
  }

  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd product = Eigen::VectorXd::Zero(size);
  Eigen::VectorXd kept_values(static_cast<Eigen::Index>(kPerLamp * kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i)
    kept_values.segment<kPerLamp>(static_cast<Eigen::Index>(kPerLamp * i)) =
        mean_.segment<kPerLamp>(kPerLamp * kept_from[i]);
  Eigen::VectorXd told_values(static_cast<Eigen::Index>(kPerLamp * told.size()));
  for (std::size_t i = 0; i < told.size(); ++i)
    told_values.segment<kPerLamp>(static_cast<Eigen::Index>(kPerLamp * i)) =
        values.segment<kPerLamp>(kPerLamp * told[i]);
  if (!kept.empty()) add(chosen(before, kept_from), kept_values, kept, kKept, information, product);
  add(chosen(covariance, told), told_values, told, 1, information, product);
  tracks_ = std::move(tracks);
  information_ = std::move(information);
  const Eigen::MatrixXd after = information_.inverse();
  mean_ = after * product;
  solves_ = kept.empty() ? 1 : kKept * solves_ + 1;

  std::vector<LampEstimate> result = now.lamps;
  for (std::size_t k = 0; k < count; ++k) {
    const auto at = static_cast<Eigen::Index>(kPerLamp * k);
    const Track& track = tracks_[k];
    LampEstimate& estimate = result[k];
    estimate.distance_m = static_cast<float>(std::exp(mean_[at]));
    estimate.log_sigma = static_cast<float>(std::sqrt(std::max(0.0, solves_ * after(at, at))));
    estimate.flat = track.flat;
    if (track.beam) estimate.log_sigma = std::max(estimate.log_sigma, now.lamps[k].log_sigma);
    estimate.beam = track.beam;
    estimate.far = track.far;
    if (track.flat) {
      estimate.normal = (-lights[k].direction + static_cast<float>(mean_[at + 1]) * track.across[0] +
                         static_cast<float>(mean_[at + 2]) * track.across[1])
                            .normalized();
    }
    if (!track.clipped) continue;
    for (Eigen::Index c = 0; c < 3; ++c) {
      const double gain = std::exp(mean_[at + 3 + c]) / std::max(lights[k].irradiance[c], 1e-12f);
      estimate.gain[c] = static_cast<float>(std::max(gain, 1.0));
    }
    const double variance = solves_ * after.diagonal().segment<3>(at + 3).mean();
    estimate.gain_log_sigma = static_cast<float>(std::sqrt(std::max(0.0, variance)));
  }
  return result;
}

}  // namespace lumigraft::reconstruct
