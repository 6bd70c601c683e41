#include "reconstruct/calibrate/vignetting.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "reconstruct/calibrate/acceptance.h"
#include "reconstruct/calibrate/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kTerms = 3;               // of the lens: θ², θ⁴, θ⁶
constexpr int kSlopes = 2, kBends = 3;  // of the light on the board
constexpr int kOwn = 1 + kSlopes + kBends;
constexpr auto& kFalloff = kCalibration.vignetting;
constexpr double kNoVariance = kFalloff.min_variance;

Eigen::Matrix<double, 1, kTerms> lens_row(double angle_rad) {
  const double s = angle_rad * angle_rad;
  return {s, s * s, s * s * s};
}

/// The model of one moment: ln(light) = own · (constant, slopes, curvatures) + lens · terms + noise.
struct Moment {
  MatrixXd own, lens;
  VectorXd ln_light;
  std::vector<std::size_t> samples;  ///< index of the input sample, by row
};

std::vector<Moment> moments_of(const std::vector<WhiteSample>& samples, const std::vector<char>& left_out) {
  std::map<std::size_t, std::vector<std::size_t>> by_moment;
  double size_m = 0;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (!left_out[i]) {
      by_moment[samples[i].moment].push_back(i);
      size_m = std::max(size_m, samples[i].on_board_m.norm());
    }
  std::vector<Moment> moments;
  for (auto& [number, rows] : by_moment) {
    if (rows.size() < 2) continue;
    Moment& moment = moments.emplace_back();
    const auto count = static_cast<Eigen::Index>(rows.size());
    moment.own.resize(count, kOwn);
    moment.lens.resize(count, kTerms);
    moment.ln_light.resize(count);
    for (Eigen::Index r = 0; r < count; ++r) {
      const WhiteSample& sample = samples[rows[static_cast<std::size_t>(r)]];
      const Eigen::Vector2d p = sample.on_board_m / std::max(size_m, 1e-9);
      moment.own.row(r) << 1, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y();
      moment.lens.row(r) = lens_row(sample.angle_rad);
      moment.ln_light[r] = std::log(sample.light);
    }
    moment.samples = std::move(rows);
  }
  return moments;
}

struct Variances {
  double noise = 1e-4, slope = 1e-2, bend = 1e-3;  // at the start of the iteration
};

struct Solution {
  Eigen::Vector3d terms = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::vector<VectorXd> own;         ///< by moment
  std::vector<MatrixXd> own_spread;  ///< covariance of `own`, including that from the terms
  std::vector<VectorXd> residuals;
  std::vector<double> noise_trace;  ///< trace of the residuals' covariance
};

/// Henderson's mixed model equations (1950): eliminates every moment's own parameters and solves for the lens's.
Solution solve(const std::vector<Moment>& moments, const Variances& v) {
  Eigen::DiagonalMatrix<double, kOwn> prior(kOwn);
  prior.diagonal() << 0, 1 / v.slope, 1 / v.slope, 1 / v.bend, 1 / v.bend, 1 / v.bend;
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  std::vector<MatrixXd> own_inverse, cross;
  for (const Moment& m : moments) {
    MatrixXd own = m.own.transpose() * m.own / v.noise;
    own += MatrixXd(prior);
    own_inverse.push_back(own.llt().solve(MatrixXd::Identity(kOwn, kOwn)));
    cross.push_back(m.own.transpose() * m.lens / v.noise);
    a += m.lens.transpose() * m.lens / v.noise - cross.back().transpose() * own_inverse.back() * cross.back();
    b += m.lens.transpose() * m.ln_light / v.noise -
         cross.back().transpose() * own_inverse.back() * (m.own.transpose() * m.ln_light) / v.noise;
  }
  Solution s;
  const Eigen::Vector3d size = a.diagonal().cwiseSqrt().cwiseMax(1e-12);
  const Eigen::Matrix3d scaled = size.cwiseInverse().asDiagonal() * a * size.cwiseInverse().asDiagonal();
  s.covariance = size.cwiseInverse().asDiagonal() * Eigen::Matrix3d(scaled.ldlt().solve(Eigen::Matrix3d::Identity())) *
                 size.cwiseInverse().asDiagonal();
  s.terms = s.covariance * b;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const Moment& m = moments[i];
    const VectorXd without_lens = m.ln_light - m.lens * s.terms;
    s.own.push_back(own_inverse[i] * (m.own.transpose() * without_lens) / v.noise);
    const MatrixXd by_terms = own_inverse[i] * cross[i];
    s.own_spread.push_back(own_inverse[i] + by_terms * s.covariance * by_terms.transpose());
    s.residuals.push_back(without_lens - m.own * s.own.back());
    const MatrixXd lens_left = m.lens - m.own * by_terms;
    s.noise_trace.push_back((m.own * own_inverse[i] * m.own.transpose()).trace() +
                            (lens_left * s.covariance * lens_left.transpose()).trace());
  }
  return s;
}

/// One iteration of expectation maximisation.
Variances next_variances(const std::vector<Moment>& moments, const Solution& s) {
  Variances sum{0, 0, 0};
  double samples = 0;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    sum.noise += s.residuals[i].squaredNorm() + s.noise_trace[i];
    samples += static_cast<double>(moments[i].ln_light.size());
    for (int k = 0; k < kOwn - 1; ++k)
      (k < kSlopes ? sum.slope : sum.bend) += s.own[i][1 + k] * s.own[i][1 + k] + s.own_spread[i](1 + k, 1 + k);
  }
  const double count = static_cast<double>(moments.size());
  return {std::max(sum.noise / samples, kFalloff.min_noise * kFalloff.min_noise),
          std::max(sum.slope / (kSlopes * count), kNoVariance), std::max(sum.bend / (kBends * count), kNoVariance)};
}

Solution fitted(const std::vector<Moment>& moments, Variances& v) {
  for (int round = 0; round < kFalloff.max_rounds; ++round) {
    const Variances next = next_variances(moments, solve(moments, v));
    const double change = std::abs(std::log(next.noise / v.noise)) + std::abs(std::log(next.slope / v.slope)) +
                          std::abs(std::log(next.bend / v.bend));
    v = next;
    if (change < kFalloff.settled) break;
  }
  return solve(moments, v);
}

}  // namespace

std::vector<WhiteSample> white_of(const std::vector<BoardView>& views, const capture::CameraModel& camera) {
  std::vector<WhiteSample> samples;
  for (std::size_t moment = 0; moment < views.size(); ++moment)
    for (const SeenPoints& seen : views[moment].seen) {
      Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
      Eigen::Vector3d on_board = Eigen::Vector3d::Zero();
      for (std::size_t i = 0; i < seen.pixels.size(); ++i) {
        pixel += seen.pixels[i] / static_cast<double>(seen.pixels.size());
        on_board += seen.points_m[i] / static_cast<double>(seen.pixels.size());
      }
      const auto direction = camera.unproject(pixel);
      if (!(seen.paper > 0) || !direction) continue;
      samples.push_back(
          {moment, on_board.head<2>(), std::atan2(direction->head<2>().norm(), direction->z()), seen.paper});
    }
  return samples;
}

VignettingCalibration calibrate_vignetting(const std::vector<WhiteSample>& samples, double field_rad) {
  VignettingCalibration result;
  result.field_rad = field_rad;
  std::vector<char> left_out(samples.size(), 0);
  for (std::size_t i = 0; i < samples.size(); ++i) left_out[i] = !(samples[i].light > 0);
  Variances variances;
  Solution solution;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int round = 0; round < 2; ++round) {
    const std::vector<Moment> moments = moments_of(samples, left_out);
    result.moments = static_cast<int>(moments.size());
    if (result.moments < kCalibration.min_views) break;
    solution = fitted(moments, variances);
    const Eigen::Matrix3d by_noise = solve(moments, {variances.noise, kNoVariance, kNoVariance}).covariance;
    covariance = by_noise + kFalloff.alike_moments * (solution.covariance - by_noise);
    result.samples = 0;
    for (std::size_t i = 0; i < moments.size(); ++i)
      for (std::size_t r = 0; r < moments[i].samples.size(); ++r) {
        const std::size_t at = moments[i].samples[r];
        if (round == 0)
          left_out[at] = std::abs(solution.residuals[i][static_cast<Eigen::Index>(r)]) >
                         kFalloff.outlier_sigmas * std::sqrt(variances.noise);
        result.widest_rad = std::max(result.widest_rad, samples[at].angle_rad);
        ++result.samples;
      }
  }
  for (int k = 0; k < kTerms; ++k) result.vignetting.terms[static_cast<std::size_t>(k)] = solution.terms[k];
  result.edge = result.vignetting.transmission(field_rad);
  result.unevenness = 2 * std::sqrt(variances.slope);
  result.residual = std::sqrt(variances.noise);
  for (int i = 1; i <= kFalloff.sigma_steps; ++i) {
    const auto row = lens_row(field_rad * i / kFalloff.sigma_steps);
    result.widest_sigma = std::max(result.widest_sigma, std::sqrt((row * covariance * row.transpose())(0)));
  }
  result.refusal = rejection_reason(result);
  return result;
}

}  // namespace lumigraft::reconstruct
