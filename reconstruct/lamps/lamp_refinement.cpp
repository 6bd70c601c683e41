#include "reconstruct/lamps/lamp_refinement.h"

#include <ceres/ceres.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <memory>

namespace lumigraft::reconstruct {
namespace {

constexpr double kNearest_m = 0.3, kFarthest_m = 12;
constexpr double kSteepest = 4;  // tilt: 76°
constexpr double kLargestGain = 1e6;
constexpr double kStep = 1e-3;  // of numeric derivatives
constexpr int kIterations = 20, kLastIterations = 60;
constexpr double kTolerance = 1e-5, kLastTolerance = 1e-6;  // of the cost
/// Errors of the model (of what is gathered, of normals) are alike over a whole surface: so many pairs are one
/// independent observation. And no pair is known better than this share of the light.
constexpr double kPairsPerObservation = 600;
constexpr double kModelShare = 0.02;
constexpr double kGainPrior = 0.1;  // 1/σ² of a log gain of which nothing is known
constexpr double kPriorPairs = 30;  // the priors are as strong as so many pairs

/// Log albedo of all samples and its derivatives, computed once per step for all pairs.
class Evaluation : public ceres::EvaluationCallback {
 public:
  Evaluation(const ShadingModel& model, std::vector<LampShape> shapes)
      : model_(model),
        shapes_(std::move(shapes)),
        parameters_(kPerLamp * shapes_.size()),
        powers_(shapes_.size()),
        factors_(shapes_.size()) {
    for (std::size_t lamp = 0; lamp < shapes_.size(); ++lamp) {
      parameters_[kPerLamp * lamp] = shapes_[lamp].log_distance;
      for (std::size_t i = 0; i < 2; ++i) parameters_[kPerLamp * lamp + 1 + i] = shapes_[lamp].tilt[i];
      for (std::size_t i = 0; i < 3; ++i) parameters_[kPerLamp * lamp + 3 + i] = shapes_[lamp].log_gain[i];
    }
  }

  void PrepareForEvaluation(bool jacobians, bool new_point) override {
    if (new_point) {
      for (std::size_t lamp = 0; lamp < shapes_.size(); ++lamp) {
        model_.factors(lamp, shape(lamp), factors_[lamp]);
        powers_[lamp] = model_.power(lamp, shape(lamp));
      }
      model_.log_albedo(powers_, factors_, log_albedo);
      derivatives_done_ = false;
    }
    if (jacobians && !derivatives_done_) differentiate();
  }

  LampShape shape(std::size_t lamp) const {
    const double* p = &parameters_[kPerLamp * lamp];
    return {p[0], shapes_[lamp].flat, {p[1], p[2]}, {p[3], p[4], p[5]}, shapes_[lamp].beam, shapes_[lamp].far};
  }
  /// Which of a lamp's parameters are known.
  std::vector<int> fixed(std::size_t lamp) const {
    std::vector<int> result;
    if (model_.placed(lamp) || shapes_[lamp].far) result = {0};
    if (!shapes_[lamp].flat || (model_.placed(lamp) && model_.light(lamp).flat)) result.insert(result.end(), {1, 2});
    if (!model_.light(lamp).clipped) result.insert(result.end(), {3, 4, 5});
    return result;
  }
  std::size_t lamps() const { return shapes_.size(); }
  std::size_t parameters() const { return parameters_.size(); }
  double* of_lamp(std::size_t lamp) { return &parameters_[kPerLamp * lamp]; }

  float told(std::size_t sample) const { return model_.told(sample, powers_, factors_); }

  std::vector<Eigen::Array3f> log_albedo;
  std::vector<std::vector<Eigen::Array3f>> derivative;  ///< per parameter, per sample

 private:
  void differentiate() {
    derivative.assign(parameters_.size(), {});
    std::vector<Eigen::Array3f> slope(log_albedo.size());
    for (std::size_t i = 0; i < slope.size(); ++i) slope[i] = model_.slope(i, powers_, factors_);
    std::vector<float> ahead, behind;
    for (std::size_t p = 0; p < parameters_.size(); ++p) {
      const std::size_t lamp = p / kPerLamp;
      const int place = static_cast<int>(p % kPerLamp);
      const std::vector<int> known = fixed(lamp);
      derivative[p].assign(log_albedo.size(), Eigen::Array3f::Zero());
      if (std::count(known.begin(), known.end(), place)) continue;
      if (place >= 3) {
        const int c = place - 3;
        for (std::size_t i = 0; i < slope.size(); ++i) {
          derivative[p][i][c] = powers_[lamp][c] * factors_[lamp][i] * slope[i][c];
        }
        continue;
      }
      const double value = parameters_[p];
      parameters_[p] = value + kStep;
      model_.factors(lamp, shape(lamp), ahead);
      parameters_[p] = value - kStep;
      model_.factors(lamp, shape(lamp), behind);
      parameters_[p] = value;
      for (std::size_t i = 0; i < ahead.size(); ++i) {
        const float change = (ahead[i] - behind[i]) / static_cast<float>(2 * kStep);
        if (change != 0) derivative[p][i] = change * powers_[lamp] * slope[i];
      }
    }
    derivatives_done_ = true;
  }

  const ShadingModel& model_;
  std::vector<LampShape> shapes_;
  std::vector<double> parameters_;
  std::vector<Eigen::Array3f> powers_;
  std::vector<std::vector<float>> factors_;
  bool derivatives_done_ = false;
};

constexpr double kPaperAlbedo = 0.8, kPaperSigma = 0.15;
constexpr double kRoomAlbedo = 0.35, kRoomSigma = 0.5;  // geometric mean over a room

double gauge_scale(const AlbedoScalePrior& gauge) { return std::sqrt(kGaugePairs / 3) / gauge.sigma; }
const double kChannelScale = 1 / (kPairScale * std::sqrt(3.0));

/// a s / (a + s) of a squared residual s.
class GemanMcClure : public ceres::LossFunction {
 public:
  explicit GemanMcClure(double level) : level_(level) {}
  void Evaluate(double s, double rho[3]) const override {
    const double w = level_ / (level_ + s);
    rho[0] = s * w;
    rho[1] = w * w;
    rho[2] = -2 * w * w / (level_ + s);
  }

 private:
  double level_;
};

class PairCost : public ceres::CostFunction {
 public:
  PairCost(const Evaluation& evaluation, SamplePair pair) : evaluation_(evaluation), pair_(pair) {
    set_num_residuals(3);
    for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) mutable_parameter_block_sizes()->push_back(kPerLamp);
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const auto a = static_cast<std::size_t>(pair_.a), b = static_cast<std::size_t>(pair_.b);
    const Eigen::Array3f difference = evaluation_.log_albedo[a] - evaluation_.log_albedo[b];
    for (int c = 0; c < 3; ++c) residuals[c] = kChannelScale * difference[c];
    for (std::size_t p = 0; jacobians && p < evaluation_.parameters(); ++p) {
      double* block = jacobians[p / kPerLamp];
      if (!block) continue;
      const Eigen::Array3f slope = evaluation_.derivative[p][a] - evaluation_.derivative[p][b];
      for (int c = 0; c < 3; ++c) block[c * kPerLamp + static_cast<int>(p % kPerLamp)] = kChannelScale * slope[c];
    }
    return true;
  }

 private:
  const Evaluation& evaluation_;
  SamplePair pair_;
};

class AlbedoScalePriorCost : public ceres::CostFunction {
 public:
  AlbedoScalePriorCost(const ShadingModel& model, const Evaluation& evaluation, int paper)
      : model_(model), evaluation_(evaluation), gauge_(gauge_of(paper)) {
    set_num_residuals(3);
    for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) mutable_parameter_block_sizes()->push_back(kPerLamp);
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const double scale = gauge_scale(gauge_);
    const Eigen::Array3f found = model_.gauged(evaluation_.log_albedo, gauge_.paper);
    for (int c = 0; c < 3; ++c) residuals[c] = scale * (found[c] - std::log(gauge_.albedo));
    for (std::size_t p = 0; jacobians && p < evaluation_.parameters(); ++p) {
      double* block = jacobians[p / kPerLamp];
      if (!block) continue;
      const Eigen::Array3f slope = model_.gauged(evaluation_.derivative[p], gauge_.paper);
      for (int c = 0; c < 3; ++c) block[c * kPerLamp + static_cast<int>(p % kPerLamp)] = scale * slope[c];
    }
    return true;
  }

 private:
  const ShadingModel& model_;
  const Evaluation& evaluation_;
  AlbedoScalePrior gauge_;
};

/// Lamps glow or are made to look as if they did: their log colours (linear Rec. 709, less their mean) lie near the
/// line from a black body of 6500 K, which is white, to one of 2700 K. Beside it tints are rare.
constexpr double kWarm[3] = {0.631, 0.134, -0.765};   // unit
constexpr double kUsualWarmth = 0.8, kLooseness = 4;  // half of the way to 2700 K; σ along the line over that beside it

/// Holds what the pairs do not decide: a lamp in a room, a panel that faces the probe more or less, and the colour of a
/// clipped lamp.
struct Prior {
  double weight;
  std::array<double, 3> log_measured;  ///< of its irradiance, which clipping made white or tinted the other way
  template <typename T>
  bool operator()(const T* p, T* residuals) const {
    residuals[0] = weight * 0.5 * (p[0] - std::log(1.5));
    residuals[1] = weight * p[1];
    residuals[2] = weight * p[2];
    const T colour[3] = {p[3] + log_measured[0], p[4] + log_measured[1], p[5] + log_measured[2]};
    const T mean = (colour[0] + colour[1] + colour[2]) / 3.0;
    T warmth = T(0);
    for (int c = 0; c < 3; ++c) warmth += kWarm[c] * colour[c];
    for (int c = 0; c < 3; ++c) residuals[3 + c] = weight * (colour[c] - mean - warmth * kWarm[c]);
    residuals[6] = weight / kLooseness * (warmth - kUsualWarmth);
    return true;
  }
};

/// Clipped lamps of one kind in a room are usually alike. Where shading tells what they send together, and not which of
/// them, this shares it out.
constexpr double kAlikeSigma = 0.7;  ///< of log radiance, mean of the channels

struct AlikeLamps {
  std::size_t first, second;
  double information;       ///< 1/σ² of
  double log_gain_between;  ///< second's less first's, were their radiance equal
};

std::vector<AlikeLamps> alike_lamps(const ShadingModel& model, const std::vector<LampShape>& shapes) {
  const auto log_measured = [&](std::size_t lamp) {
    const PointLight& light = model.light(lamp);
    return static_cast<double>(light.irradiance.cwiseMax(1e-12f).array().log().mean()) -
           2 * std::log(static_cast<double>(light.angular_radius_rad));
  };
  std::vector<AlikeLamps> result;
  for (const bool flat : {false, true}) {
    std::vector<std::size_t> kind;
    for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp) {
      const PointLight& light = model.light(lamp);
      if (light.clipped && light.shown == PointLight::Shown::yes && shapes[lamp].flat == flat) kind.push_back(lamp);
    }
    for (std::size_t i = 0; i < kind.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        result.push_back({kind[k], kind[i], 2 / (static_cast<double>(kind.size()) * kAlikeSigma * kAlikeSigma),
                          log_measured(kind[k]) - log_measured(kind[i])});
      }
    }
  }
  return result;
}

struct Alike {
  double weight, log_gain_between;
  template <typename T>
  bool operator()(const T* first, const T* second, T* residual) const {
    T between = T(0);
    for (int c = 0; c < 3; ++c) between += (second[3 + c] - first[3 + c]) / 3.0;
    residual[0] = weight * (between - log_gain_between);
    return true;
  }
};

struct Spread {
  Eigen::MatrixXd covariance;
  double pair_variance;
};

/// Covariance of all parameters from the curvature of the robust cost (weights 1 / (1 + r²)²), of the gauge where a
/// gauge is needed, of lamps that are alike, and of wide priors.
Spread spread_of(const ShadingModel& model, const Evaluation& evaluation, const std::vector<SamplePair>& pairs,
                 int paper, bool gauged, const std::vector<AlikeLamps>& alikes) {
  const auto size = static_cast<Eigen::Index>(evaluation.parameters());
  Eigen::MatrixXd curvature = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd row(size), raised = Eigen::VectorXd::Ones(size);  // of lamps that send next to nothing
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) {
    if (model.light(lamp).shown == PointLight::Shown::yes) continue;
    const LampShape shape = evaluation.shape(lamp);
    for (std::size_t c = 0; c < 3; ++c)
      raised[static_cast<Eigen::Index>(kPerLamp * lamp + 3 + c)] = std::exp(std::max(0.0, kLogDim - shape.log_gain[c]));
  }
  double squares = 0, weights = 0;
  for (const SamplePair& pair : pairs) {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    const Eigen::Array3f r = static_cast<float>(kChannelScale) * (evaluation.log_albedo[a] - evaluation.log_albedo[b]);
    const double told = std::pow(std::min(evaluation.told(a), evaluation.told(b)), 2);
    const double weight = told / std::pow(1 + r.square().sum(), 2);
    squares += weight * r.square().sum();
    weights += 3 * weight;
    for (int c = 0; c < 3; ++c) {
      for (Eigen::Index p = 0; p < size; ++p) {
        const auto& derivative = evaluation.derivative[static_cast<std::size_t>(p)];
        row[p] = raised[p] * kChannelScale * (derivative[a][c] - derivative[b][c]);
      }
      curvature.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
    }
  }
  curvature = curvature.selfadjointView<Eigen::Lower>();
  const double least = std::pow(kModelShare / kPairScale, 2) / 3;
  const double variance = kPairsPerObservation * std::max(least, squares / std::max(weights, 1e-9));
  curvature /= variance;
  const AlbedoScalePrior gauge = gauge_of(paper);
  for (int c = 0; gauged && c < 3; ++c) {
    for (Eigen::Index p = 0; p < size; ++p) {
      row[p] = raised[p] * model.gauged(evaluation.derivative[static_cast<std::size_t>(p)], paper)[c] / gauge.sigma;
    }
    curvature += row * row.transpose();
  }
  for (Eigen::Index p = 0; p < size; ++p) {
    const Eigen::Index place = p % kPerLamp;
    curvature(p, p) += place == 0 ? 0.25 : place < 3 ? 1 : kGainPrior;
  }
  for (const AlikeLamps& alike : alikes) {
    row.setZero();
    row.segment<3>(static_cast<Eigen::Index>(kPerLamp * alike.first + 3)).setConstant(-1.0 / 3);
    row.segment<3>(static_cast<Eigen::Index>(kPerLamp * alike.second + 3)).setConstant(1.0 / 3);
    curvature += alike.information * row * row.transpose();
  }
  return {curvature.inverse(), variance};
}

}  // namespace

double robust_cost(const std::vector<Eigen::Array3f>& log_albedo, const std::vector<SamplePair>& pairs, double level) {
  double sum = 0;
  const float scale = static_cast<float>(kChannelScale * kChannelScale);
  for (const SamplePair& pair : pairs) {
    const Eigen::Array3f d =
        log_albedo[static_cast<std::size_t>(pair.a)] - log_albedo[static_cast<std::size_t>(pair.b)];
    const double squared = scale * d.square().sum();
    sum += level * squared / (level + squared);
  }
  return sum;
}

bool has_clipped(const ShadingModel& model) {
  for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp)
    if (model.light(lamp).clipped && model.light(lamp).shown == PointLight::Shown::yes) return true;
  return false;
}

bool has_gauge(const ShadingModel& model, int paper) {
  if (has_clipped(model)) return true;
  for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp)
    if (model.light(lamp).clipped) return paper >= 0;
  return false;
}

AlbedoScalePrior gauge_of(int paper) {
  return paper >= 0 ? AlbedoScalePrior{paper, kPaperAlbedo, kPaperSigma}
                    : AlbedoScalePrior{-1, kRoomAlbedo, kRoomSigma};
}

double gauge_cost(const ShadingModel& model, const std::vector<Eigen::Array3f>& log_albedo, int paper) {
  const AlbedoScalePrior gauge = gauge_of(paper);
  const Eigen::Array3f off = model.gauged(log_albedo, paper) - static_cast<float>(std::log(gauge.albedo));
  return gauge_scale(gauge) * gauge_scale(gauge) * off.square().sum();
}

Refinement refine_lamps(const ShadingModel& model, const std::vector<SamplePair>& pairs, int paper,
                        const std::vector<LampShape>& start, Search how) {
  Evaluation evaluation(model, start);
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &evaluation;
  ceres::Problem problem(problem_options);
  std::vector<double*> blocks;
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) blocks.push_back(evaluation.of_lamp(lamp));
  for (const SamplePair& pair : pairs) {
    problem.AddResidualBlock(new PairCost(evaluation, pair), new GemanMcClure(how == Search::fine ? 1 : kWideLevel),
                             blocks);
  }
  const bool gauged = has_gauge(model, paper);
  if (gauged) problem.AddResidualBlock(new AlbedoScalePriorCost(model, evaluation, paper), nullptr, blocks);
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) {
    double* p = evaluation.of_lamp(lamp);
    auto* prior = new Prior{std::sqrt(kPriorPairs), {}};
    for (int c = 0; c < 3; ++c) {
      prior->log_measured[static_cast<std::size_t>(c)] = std::log(std::max(model.light(lamp).irradiance[c], 1e-12f));
    }
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Prior, 7, kPerLamp>(prior), nullptr, p);
    const std::vector<int> known = evaluation.fixed(lamp);
    if (known.size() == kPerLamp) {
      problem.SetParameterBlockConstant(p);
      continue;
    }
    for (int i = 0; i < kPerLamp; ++i) {
      if (std::count(known.begin(), known.end(), i)) continue;
      problem.SetParameterLowerBound(p, i, i == 0 ? std::log(kNearest_m) : i < 3 ? -kSteepest : 0);
      problem.SetParameterUpperBound(p, i, i == 0 ? std::log(kFarthest_m) : i < 3 ? kSteepest : std::log(kLargestGain));
    }
    if (!known.empty()) problem.SetManifold(p, new ceres::SubsetManifold(kPerLamp, known));
  }
  const std::vector<AlikeLamps> alikes = alike_lamps(model, start);
  for (const AlikeLamps& alike : alikes) {
    auto* cost = new Alike{std::sqrt(alike.information * kGaugePairs / 3), alike.log_gain_between};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Alike, 1, kPerLamp, kPerLamp>(cost), nullptr,
                             evaluation.of_lamp(alike.first), evaluation.of_lamp(alike.second));
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = how == Search::fine ? kLastIterations : kIterations;
  options.function_tolerance = how == Search::fine ? kLastTolerance : kTolerance;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  evaluation.PrepareForEvaluation(true, true);
  Refinement result;
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) result.shapes.push_back(evaluation.shape(lamp));
  result.cost = robust_cost(evaluation.log_albedo, pairs);
  if (gauged) result.cost += gauge_cost(model, evaluation.log_albedo, paper);
  const Spread spread = spread_of(model, evaluation, pairs, paper, gauged, alikes);
  result.covariance = spread.covariance;
  result.pair_variance = spread.pair_variance;
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) {
    const auto p = static_cast<Eigen::Index>(kPerLamp * lamp);
    result.log_sigma.push_back(std::sqrt(std::max(0.0, result.covariance(p, p))));
    result.gain_log_sigma.push_back(std::sqrt(std::max(0.0, result.covariance.diagonal().segment(p + 3, 3).mean())));
  }
  return result;
}

}  // namespace lumigraft::reconstruct
