#include "reconstruct/lamps/lamp_refinement.h"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Refinement& kRefinement = kLampParameters.refinement;
const float kChannelScale = static_cast<float>(1 / (kRefinement.pair_scale * std::sqrt(3.0)));

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
      const std::vector<int> known = fixed(lamp);
      for (int i = 0; i < kUnknownsPerLamp; ++i)
        if (!std::count(known.begin(), known.end(), i))
          free_.push_back(kUnknownsPerLamp * lamp + static_cast<std::size_t>(i));
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
    LampShape shape = shapes_[lamp];
    shape.log_distance = p[0];
    shape.tilt = {p[1], p[2]};
    shape.log_gain = {p[3], p[4], p[5]};
    return shape;
  }
  /// Indices of a lamp's parameters that are known.
  std::vector<int> fixed(std::size_t lamp) const {
    if (shapes_[lamp].held) return {0, 1, 2, 3, 4, 5};
    std::vector<int> result;
    if (model_.placed(lamp) || shapes_[lamp].far) result = {0};
    if (!shapes_[lamp].flat || (model_.placed(lamp) && model_.light(lamp).flat)) result.insert(result.end(), {1, 2});
    if (!model_.light(lamp).clipped) result.insert(result.end(), {3, 4, 5});
    return result;
  }
  const std::vector<std::size_t>& free() const { return free_; }  ///< indices of all parameters that are not fixed
  /// Difference of log albedo over pair_scale; its squared norm is the mean of squares over the channels.
  Eigen::Vector3f residual(const SamplePair& pair) const {
    return kChannelScale *
           (log_albedo[static_cast<std::size_t>(pair.a)] - log_albedo[static_cast<std::size_t>(pair.b)]);
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
    std::vector<Eigen::Array3f> slope(model_.samples());
    for (std::size_t i = 0; i < slope.size(); ++i) slope[i] = model_.slope(i, powers_, factors_);
    std::vector<float> ahead, behind;
    for (std::vector<Eigen::Array3f>& of_parameter : derivative)
      of_parameter.assign(log_albedo.size(), Eigen::Array3f::Zero());
    for (const std::size_t p : free_) {
      const std::size_t lamp = p / kUnknownsPerLamp;
      const int unknown = static_cast<int>(p % kUnknownsPerLamp);
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
  std::vector<std::size_t> free_;
  std::vector<Eigen::Array3f> powers_;
  std::vector<std::vector<float>> factors_;
  bool derivatives_done_ = false;
};

double albedo_scale_weight(const AlbedoScalePrior& prior) {
  return std::sqrt(kRefinement.scale_pairs / 3) / prior.log_sigma;
}
/// Σ w |r|² over pairs, linearized in the free parameters.
struct NormalEquations {
  Eigen::MatrixXd curvature;  ///< Jᵀ W J
  Eigen::VectorXd gradient;   ///< Jᵀ W r
};

/// `weight_of(pair, |r|²)`: w.
template <typename WeightOf>
NormalEquations normal_equations(const Evaluation& evaluation, const std::vector<SamplePair>& pairs,
                                 const WeightOf& weight_of) {
  constexpr Eigen::Index kPairsAtOnce = 128;  // a product of matrices is faster than one of vectors
  const std::vector<std::size_t>& free = evaluation.free();
  const auto size = static_cast<Eigen::Index>(free.size()), count = static_cast<Eigen::Index>(pairs.size());
  NormalEquations sum{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  Eigen::Matrix3Xf residuals(3, count);
  Eigen::VectorXf roots(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SamplePair& pair = pairs[static_cast<std::size_t>(i)];
    const Eigen::Vector3f r = evaluation.residual(pair);
    roots[i] = static_cast<float>(std::sqrt(pair.weight * weight_of(pair, static_cast<double>(r.squaredNorm()))));
    residuals.col(i) = roots[i] * r;
  }
  for (Eigen::Index c = 0; c < 3; ++c) {
    std::vector<Eigen::Index> own;  // free parameters on which this channel depends
    for (Eigen::Index k = 0; k < size; ++k) {
      const std::size_t unknown = free[static_cast<std::size_t>(k)] % kUnknownsPerLamp;
      if (unknown < 3 || unknown == 3 + static_cast<std::size_t>(c)) own.push_back(k);
    }
    for (Eigen::Index first = 0; first < count; first += kPairsAtOnce) {
      const Eigen::Index rows = std::min(kPairsAtOnce, count - first);
      Eigen::MatrixXf slopes(rows, static_cast<Eigen::Index>(own.size()));
      for (Eigen::Index k = 0; k < slopes.cols(); ++k) {
        const auto parameter = free[static_cast<std::size_t>(own[static_cast<std::size_t>(k)])];
        const std::vector<Eigen::Array3f>& derivative = evaluation.derivative[parameter];
        for (Eigen::Index i = 0; i < rows; ++i) {
          const SamplePair& pair = pairs[static_cast<std::size_t>(first + i)];
          slopes(i, k) =
              kChannelScale * roots[first + i] *
              (derivative[static_cast<std::size_t>(pair.a)][c] - derivative[static_cast<std::size_t>(pair.b)][c]);
        }
      }
      const Eigen::MatrixXd product = (slopes.transpose() * slopes).cast<double>();
      sum.curvature(own, own) += product;
      sum.gradient(own) += (slopes.transpose() * residuals.row(c).segment(first, rows).transpose()).cast<double>();
    }
  }
  return sum;
}

/// The robust cost of all pairs (Geman and McClure 1985): a s / (a + s) of a squared residual s with level a. Ceres
/// gets as many residuals as there are free parameters, and one more, whose cost, gradient and curvature are those of
/// all pairs together, each weighted with the slope of its robust cost (Triggs et al. 2000, section 4.3). Thousands of
/// residuals of their own would take ten times as long.
class PairsCost : public ceres::CostFunction {
 public:
  PairsCost(const Evaluation& evaluation, const std::vector<SamplePair>& pairs, double level)
      : evaluation_(evaluation), pairs_(pairs), level_(level) {
    set_num_residuals(static_cast<int>(evaluation.free().size()) + 1);
    mutable_parameter_block_sizes()->assign(evaluation.lamps(), kUnknownsPerLamp);
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const auto size = static_cast<Eigen::Index>(evaluation_.free().size());
    Eigen::Map<Eigen::VectorXd> reduced(residuals, size + 1);
    reduced.setZero();
    double cost = 0;
    for (const SamplePair& pair : pairs_) {
      const double s = evaluation_.residual(pair).squaredNorm();
      cost += pair.weight * level_ * s / (level_ + s);
    }
    if (jacobians && size > 0) {
      const NormalEquations sum = normal_equations(
          evaluation_, pairs_, [&](const SamplePair&, double s) { return std::pow(level_ / (level_ + s), 2); });
      // Jᵀ J = V D Vᵀ: the reduced Jacobian is √D Vᵀ.
      const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(sum.curvature);
      const Eigen::VectorXd root = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
      const Eigen::VectorXd along = eigen.eigenvectors().transpose() * sum.gradient;
      for (Eigen::Index k = 0; k < size; ++k)
        if (root[k] > kMinRelativeRoot * root[size - 1]) reduced[k] = along[k] / root[k];
      const Eigen::MatrixXd jacobian = root.asDiagonal() * eigen.eigenvectors().transpose();
      write(jacobian, jacobians);
    }
    reduced[size] = std::sqrt(std::max(0.0, cost - reduced.squaredNorm()));
    return true;
  }

 private:
  static constexpr double kMinRelativeRoot = 1e-9;  // below it a direction has no influence but rounding

  void write(const Eigen::MatrixXd& jacobian, double** blocks) const {
    for (std::size_t lamp = 0; lamp < evaluation_.lamps(); ++lamp)
      if (blocks[lamp]) std::fill_n(blocks[lamp], num_residuals() * kUnknownsPerLamp, 0.0);
    for (Eigen::Index k = 0; k < jacobian.cols(); ++k) {
      const std::size_t parameter = evaluation_.free()[static_cast<std::size_t>(k)];
      double* block = blocks[parameter / kUnknownsPerLamp];
      if (!block) continue;
      for (Eigen::Index row = 0; row < jacobian.rows(); ++row)
        block[static_cast<std::size_t>(row) * kUnknownsPerLamp + parameter % kUnknownsPerLamp] = jacobian(row, k);
    }
  }

  const Evaluation& evaluation_;
  const std::vector<SamplePair>& pairs_;
  double level_;
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
  const NormalEquations sum = normal_equations(evaluation, pairs, [&](const SamplePair& pair, double s) {
    const auto of_known = static_cast<std::size_t>(pair.b) >= model.samples() ? model.samples() : 0;
    const double information =
        std::min(evaluation.information_weight(static_cast<std::size_t>(pair.a)),
                 evaluation.information_weight(static_cast<std::size_t>(pair.b) - of_known));
    const double weight = std::pow(information / (1 + s), 2);
    squares += pair.weight * weight * s;
    weights += 3 * pair.weight * weight;
    return weight;
  });
  const std::vector<std::size_t>& free = evaluation.free();
  for (std::size_t i = 0; i < free.size(); ++i) {
    for (std::size_t k = 0; k < free.size(); ++k) {
      const auto p = static_cast<Eigen::Index>(free[i]), q = static_cast<Eigen::Index>(free[k]);
      curvature(p, q) = scale[p] * scale[q] * sum.curvature(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
    }
  }
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
    sum += pair.weight * level * squared / (level + squared);
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
  // Bounds make Ceres search along each step: from costs alone, since derivatives are the expensive part.
  options.line_search_interpolation_type = ceres::QUADRATIC;
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
  problem.AddResidualBlock(new PairsCost(evaluation, pairs, how == Search::fine ? 1 : kRefinement.wide_level), nullptr,
                           blocks);
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
