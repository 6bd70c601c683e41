#include "reconstruct/lamps/lamp_refinement.h"

#include <ceres/ceres.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Refinement& kRefinement = kLampParameters.refinement;

/// Log albedo of all samples and its derivatives, computed once per step for all pairs.
class Evaluation : public ceres::EvaluationCallback {
 public:
  Evaluation(const ShadingModel& model, std::vector<LampShape> shapes)
      : model_(model),
        shapes_(std::move(shapes)),
        parameters_(kUnknownsPerLamp * shapes_.size()),
        powers_(shapes_.size()),
        factors_(shapes_.size()) {
    for (std::size_t lamp = 0; lamp < shapes_.size(); ++lamp) {
      parameters_[kUnknownsPerLamp * lamp] = shapes_[lamp].log_distance;
      for (std::size_t i = 0; i < 2; ++i) parameters_[kUnknownsPerLamp * lamp + 1 + i] = shapes_[lamp].tilt[i];
      for (std::size_t i = 0; i < 3; ++i) parameters_[kUnknownsPerLamp * lamp + 3 + i] = shapes_[lamp].log_gain[i];
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
    const double* p = &parameters_[kUnknownsPerLamp * lamp];
    return {p[0], shapes_[lamp].flat, {p[1], p[2]}, {p[3], p[4], p[5]}, shapes_[lamp].beam, shapes_[lamp].far};
  }
  /// Indices of a lamp's parameters that are known.
  std::vector<int> fixed(std::size_t lamp) const {
    std::vector<int> result;
    if (model_.placed(lamp) || shapes_[lamp].far) result = {0};
    if (!shapes_[lamp].flat || (model_.placed(lamp) && model_.light(lamp).flat)) result.insert(result.end(), {1, 2});
    if (!model_.light(lamp).clipped) result.insert(result.end(), {3, 4, 5});
    return result;
  }
  std::size_t lamps() const { return shapes_.size(); }
  std::size_t parameters() const { return parameters_.size(); }
  double* of_lamp(std::size_t lamp) { return &parameters_[kUnknownsPerLamp * lamp]; }

  float information_weight(std::size_t sample) const { return model_.information_weight(sample, powers_, factors_); }

  std::vector<Eigen::Array3f> log_albedo;
  std::vector<std::vector<Eigen::Array3f>> derivative;  ///< per parameter, per sample

 private:
  void differentiate() {
    derivative.assign(parameters_.size(), {});
    std::vector<Eigen::Array3f> slope(log_albedo.size());
    for (std::size_t i = 0; i < slope.size(); ++i) slope[i] = model_.slope(i, powers_, factors_);
    std::vector<float> ahead, behind;
    for (std::size_t p = 0; p < parameters_.size(); ++p) {
      const std::size_t lamp = p / kUnknownsPerLamp;
      const int unknown = static_cast<int>(p % kUnknownsPerLamp);
      const std::vector<int> known = fixed(lamp);
      derivative[p].assign(log_albedo.size(), Eigen::Array3f::Zero());
      if (std::count(known.begin(), known.end(), unknown)) continue;
      if (unknown >= 3) {
        const int c = unknown - 3;
        for (std::size_t i = 0; i < slope.size(); ++i) {
          derivative[p][i][c] = powers_[lamp][c] * factors_[lamp][i] * slope[i][c];
        }
        continue;
      }
      const double value = parameters_[p];
      parameters_[p] = value + kRefinement.step;
      model_.factors(lamp, shape(lamp), ahead);
      parameters_[p] = value - kRefinement.step;
      model_.factors(lamp, shape(lamp), behind);
      parameters_[p] = value;
      for (std::size_t i = 0; i < ahead.size(); ++i) {
        const float change = (ahead[i] - behind[i]) / static_cast<float>(2 * kRefinement.step);
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

double albedo_scale_weight(const AlbedoScalePrior& prior) {
  return std::sqrt(kRefinement.scale_pairs / 3) / prior.log_sigma;
}
const double kChannelScale = 1 / (kRefinement.pair_scale * std::sqrt(3.0));

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
    for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp)
      mutable_parameter_block_sizes()->push_back(kUnknownsPerLamp);
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const auto a = static_cast<std::size_t>(pair_.a), b = static_cast<std::size_t>(pair_.b);
    const Eigen::Array3f difference = evaluation_.log_albedo[a] - evaluation_.log_albedo[b];
    for (int c = 0; c < 3; ++c) residuals[c] = kChannelScale * difference[c];
    for (std::size_t p = 0; jacobians && p < evaluation_.parameters(); ++p) {
      double* block = jacobians[p / kUnknownsPerLamp];
      if (!block) continue;
      const Eigen::Array3f slope = evaluation_.derivative[p][a] - evaluation_.derivative[p][b];
      for (int c = 0; c < 3; ++c)
        block[c * kUnknownsPerLamp + static_cast<int>(p % kUnknownsPerLamp)] = kChannelScale * slope[c];
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
      : model_(model), evaluation_(evaluation), prior_(albedo_scale_prior(paper)) {
    set_num_residuals(3);
    for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp)
      mutable_parameter_block_sizes()->push_back(kUnknownsPerLamp);
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const double scale = albedo_scale_weight(prior_);
    const Eigen::Array3f found = model_.scale_reference(evaluation_.log_albedo, prior_.paper);
    for (int c = 0; c < 3; ++c) residuals[c] = scale * (found[c] - std::log(prior_.albedo));
    for (std::size_t p = 0; jacobians && p < evaluation_.parameters(); ++p) {
      double* block = jacobians[p / kUnknownsPerLamp];
      if (!block) continue;
      const Eigen::Array3f slope = model_.scale_reference(evaluation_.derivative[p], prior_.paper);
      for (int c = 0; c < 3; ++c)
        block[c * kUnknownsPerLamp + static_cast<int>(p % kUnknownsPerLamp)] = scale * slope[c];
    }
    return true;
  }

 private:
  const ShadingModel& model_;
  const Evaluation& evaluation_;
  AlbedoScalePrior prior_;
};

/// Prior of what the pairs may not determine: distance, a panel that faces the probe, and the colour of a clipped lamp.
struct Prior {
  double weight;
  std::array<double, 3> log_measured;  ///< irradiance, whose colour clipping changed
  template <typename T>
  bool operator()(const T* p, T* residuals) const {
    residuals[0] = weight * kRefinement.distance_prior * (p[0] - std::log(kLampParameters.usual_distance_m));
    residuals[1] = weight * kRefinement.tilt_prior * p[1];
    residuals[2] = weight * kRefinement.tilt_prior * p[2];
    const T colour[3] = {p[3] + log_measured[0], p[4] + log_measured[1], p[5] + log_measured[2]};
    const T mean = (colour[0] + colour[1] + colour[2]) / 3.0;
    T warmth = T(0);
    for (int c = 0; c < 3; ++c) warmth += kRefinement.warm[c] * colour[c];
    for (int c = 0; c < 3; ++c) residuals[3 + c] = weight * (colour[c] - mean - warmth * kRefinement.warm[c]);
    residuals[6] = weight / kRefinement.warmth_looseness * (warmth - kRefinement.usual_warmth);
    return true;
  }
};

/// Clipped lamps of one kind in a room usually have equal radiance. Where shading determines their sum but not each of
/// them, this prior divides it.
struct AlikeLamps {
  std::size_t first, second;
  double information;     ///< 1/σ²
  double log_gain_ratio;  ///< of second to first, for equal radiance
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
      if (light.clipped && light.visibility == PointLight::Visibility::visible && shapes[lamp].flat == flat)
        kind.push_back(lamp);
    }
    for (std::size_t i = 0; i < kind.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        result.push_back(
            {kind[k], kind[i],
             2 / (static_cast<double>(kind.size()) * kRefinement.alike_log_sigma * kRefinement.alike_log_sigma),
             log_measured(kind[k]) - log_measured(kind[i])});
      }
    }
  }
  return result;
}

struct Alike {
  double weight, log_gain_ratio;
  template <typename T>
  bool operator()(const T* first, const T* second, T* residual) const {
    T ratio = T(0);
    for (int c = 0; c < 3; ++c) ratio += (second[3 + c] - first[3 + c]) / 3.0;
    residual[0] = weight * (ratio - log_gain_ratio);
    return true;
  }
};

struct Uncertainty {
  Eigen::MatrixXd covariance;
  double pair_variance;
};

/// Covariance of all parameters from the curvature of the robust cost (weights 1 / (1 + r²)²), of the prior of the
/// albedo scale if used, of the prior of alike lamps, and of the wide priors.
Uncertainty uncertainty_of(const ShadingModel& model, const Evaluation& evaluation,
                           const std::vector<SamplePair>& pairs, int paper, bool with_scale_prior,
                           const std::vector<AlikeLamps>& alikes) {
  const auto size = static_cast<Eigen::Index>(evaluation.parameters());
  Eigen::MatrixXd curvature = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd row(size), scale = Eigen::VectorXd::Ones(size);
  // Log gains of unseen lamps that are nearly off differ much without any effect: their uncertainty is that at log_dim.
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) {
    if (model.light(lamp).visibility == PointLight::Visibility::visible) continue;
    const LampShape shape = evaluation.shape(lamp);
    for (std::size_t c = 0; c < 3; ++c)
      scale[static_cast<Eigen::Index>(kUnknownsPerLamp * lamp + 3 + c)] =
          std::exp(std::max(0.0, kRefinement.log_dim - shape.log_gain[c]));
  }
  double squares = 0, weights = 0;
  for (const SamplePair& pair : pairs) {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    const Eigen::Array3f r = static_cast<float>(kChannelScale) * (evaluation.log_albedo[a] - evaluation.log_albedo[b]);
    const double information =
        std::pow(std::min(evaluation.information_weight(a), evaluation.information_weight(b)), 2);
    const double weight = information / std::pow(1 + r.square().sum(), 2);
    squares += weight * r.square().sum();
    weights += 3 * weight;
    for (int c = 0; c < 3; ++c) {
      for (Eigen::Index p = 0; p < size; ++p) {
        const auto& derivative = evaluation.derivative[static_cast<std::size_t>(p)];
        row[p] = scale[p] * kChannelScale * (derivative[a][c] - derivative[b][c]);
      }
      curvature.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
    }
  }
  curvature = curvature.selfadjointView<Eigen::Lower>();
  const double min_variance = std::pow(kRefinement.model_error / kRefinement.pair_scale, 2) / 3;
  const double variance = kRefinement.pairs_per_observation * std::max(min_variance, squares / std::max(weights, 1e-9));
  curvature /= variance;
  const AlbedoScalePrior prior = albedo_scale_prior(paper);
  for (int c = 0; with_scale_prior && c < 3; ++c) {
    for (Eigen::Index p = 0; p < size; ++p) {
      row[p] = scale[p] * model.scale_reference(evaluation.derivative[static_cast<std::size_t>(p)], paper)[c] /
               prior.log_sigma;
    }
    curvature += row * row.transpose();
  }
  for (Eigen::Index p = 0; p < size; ++p) {
    const Eigen::Index unknown = p % kUnknownsPerLamp;
    curvature(p, p) += unknown == 0  ? kRefinement.distance_prior * kRefinement.distance_prior
                       : unknown < 3 ? kRefinement.tilt_prior * kRefinement.tilt_prior
                                     : kRefinement.gain_prior;
  }
  for (const AlikeLamps& alike : alikes) {
    row.setZero();
    row.segment<3>(static_cast<Eigen::Index>(kUnknownsPerLamp * alike.first + 3)).setConstant(-1.0 / 3);
    row.segment<3>(static_cast<Eigen::Index>(kUnknownsPerLamp * alike.second + 3)).setConstant(1.0 / 3);
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
    if (model.light(lamp).clipped && model.light(lamp).visibility == PointLight::Visibility::visible) return true;
  return false;
}

bool needs_albedo_scale_prior(const ShadingModel& model, int paper) {
  if (has_clipped(model)) return true;
  for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp)
    if (model.light(lamp).clipped) return paper >= 0;
  return false;
}

AlbedoScalePrior albedo_scale_prior(int paper) {
  return paper >= 0 ? AlbedoScalePrior{paper, kRefinement.paper_albedo, kRefinement.paper_log_sigma}
                    : AlbedoScalePrior{-1, kRefinement.room_albedo, kRefinement.room_log_sigma};
}

double albedo_scale_cost(const ShadingModel& model, const std::vector<Eigen::Array3f>& log_albedo, int paper) {
  const AlbedoScalePrior prior = albedo_scale_prior(paper);
  const Eigen::Array3f error = model.scale_reference(log_albedo, paper) - static_cast<float>(std::log(prior.albedo));
  return albedo_scale_weight(prior) * albedo_scale_weight(prior) * error.square().sum();
}

namespace {

/// Prior and bounds of one lamp's unknowns.
void add_lamp(ceres::Problem& problem, Evaluation& evaluation, const ShadingModel& model, std::size_t lamp) {
  double* p = evaluation.of_lamp(lamp);
  auto* prior = new Prior{std::sqrt(kRefinement.prior_pairs), {}};
  for (int c = 0; c < 3; ++c) {
    prior->log_measured[static_cast<std::size_t>(c)] = std::log(std::max(model.light(lamp).irradiance[c], 1e-12f));
  }
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Prior, 7, kUnknownsPerLamp>(prior), nullptr, p);
  const std::vector<int> known = evaluation.fixed(lamp);
  if (known.size() == kUnknownsPerLamp) {
    problem.SetParameterBlockConstant(p);
    return;
  }
  for (int i = 0; i < kUnknownsPerLamp; ++i) {
    if (std::count(known.begin(), known.end(), i)) continue;
    const double max_tilt = kRefinement.max_tilt;
    problem.SetParameterLowerBound(p, i, i == 0 ? std::log(kRefinement.min_distance_m) : i < 3 ? -max_tilt : 0);
    problem.SetParameterUpperBound(p, i,
                                   i == 0  ? std::log(kRefinement.max_distance_m)
                                   : i < 3 ? max_tilt
                                           : std::log(kRefinement.max_gain));
  }
  if (!known.empty()) problem.SetManifold(p, new ceres::SubsetManifold(kUnknownsPerLamp, known));
}

void minimise(ceres::Problem& problem, Search how) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = how == Search::fine ? kRefinement.fine_iterations : kRefinement.rough_iterations;
  options.function_tolerance = how == Search::fine ? kRefinement.fine_tolerance : kRefinement.rough_tolerance;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
}

}  // namespace

Refinement refine_lamps(const ShadingModel& model, const std::vector<SamplePair>& pairs, int paper,
                        const std::vector<LampShape>& start, Search how) {
  Evaluation evaluation(model, start);
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &evaluation;
  ceres::Problem problem(problem_options);
  std::vector<double*> blocks;
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) blocks.push_back(evaluation.of_lamp(lamp));
  for (const SamplePair& pair : pairs) {
    problem.AddResidualBlock(new PairCost(evaluation, pair),
                             new GemanMcClure(how == Search::fine ? 1 : kRefinement.wide_level), blocks);
  }
  const bool with_scale_prior = needs_albedo_scale_prior(model, paper);
  if (with_scale_prior) problem.AddResidualBlock(new AlbedoScalePriorCost(model, evaluation, paper), nullptr, blocks);
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) add_lamp(problem, evaluation, model, lamp);
  const std::vector<AlikeLamps> alikes = alike_lamps(model, start);
  for (const AlikeLamps& alike : alikes) {
    auto* cost = new Alike{std::sqrt(alike.information * kRefinement.scale_pairs / 3), alike.log_gain_ratio};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Alike, 1, kUnknownsPerLamp, kUnknownsPerLamp>(cost),
                             nullptr, evaluation.of_lamp(alike.first), evaluation.of_lamp(alike.second));
  }
  minimise(problem, how);

  evaluation.PrepareForEvaluation(true, true);
  Refinement result;
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) result.shapes.push_back(evaluation.shape(lamp));
  result.cost = robust_cost(evaluation.log_albedo, pairs);
  if (with_scale_prior) result.cost += albedo_scale_cost(model, evaluation.log_albedo, paper);
  const Uncertainty uncertainty = uncertainty_of(model, evaluation, pairs, paper, with_scale_prior, alikes);
  result.covariance = uncertainty.covariance;
  result.pair_variance = uncertainty.pair_variance;
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) {
    const auto p = static_cast<Eigen::Index>(kUnknownsPerLamp * lamp);
    result.log_sigma.push_back(std::sqrt(std::max(0.0, result.covariance(p, p))));
    result.gain_log_sigma.push_back(std::sqrt(std::max(0.0, result.covariance.diagonal().segment(p + 3, 3).mean())));
  }
  return result;
}

}  // namespace lumigraft::reconstruct
