#include "reconstruct/lamps/lamp_posterior.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Posterior& kPosterior = kLampParameters.posterior;
constexpr float kChannelScale = static_cast<float>(std::numbers::inv_sqrt3 / kPosterior.pair_scale);

/// Log albedo of all samples and its derivatives, computed once per step for all pairs.
class Evaluation : public ceres::EvaluationCallback {
 public:
  Evaluation(const ShadingModel& model, std::vector<LampShape> shapes)
      : model_(model), shapes_(std::move(shapes)), powers_(shapes_.size()), factors_(shapes_.size()) {
    for (std::size_t lamp = 0; lamp < shapes_.size(); ++lamp) {
      const LampShape& shape = shapes_[lamp];
      unknowns_.insert(unknowns_.end(), {shape.inverse_distance, shape.tilt[0], shape.tilt[1], shape.log_gain[0],
                                         shape.log_gain[1], shape.log_gain[2]});
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
    const double* p = &unknowns_[kUnknownsPerLamp * lamp];
    LampShape shape = shapes_[lamp];
    shape.inverse_distance = p[0];
    shape.tilt = {p[1], p[2]};
    shape.log_gain = {p[3], p[4], p[5]};
    return shape;
  }
  std::vector<LampShape> shapes() const {
    std::vector<LampShape> result;
    for (std::size_t lamp = 0; lamp < lamps(); ++lamp) result.push_back(shape(lamp));
    return result;
  }
  /// Indices of a lamp's unknowns that are known.
  std::vector<int> fixed(std::size_t lamp) const {
    if (shapes_[lamp].held) return {0, 1, 2, 3, 4, 5};
    std::vector<int> result;
    if (model_.placed(lamp) || shapes_[lamp].far || shapes_[lamp].weak) result = {0};
    if (!shapes_[lamp].flat || shapes_[lamp].weak || (model_.placed(lamp) && model_.light(lamp).flat))
      result.insert(result.end(), {1, 2});
    if (!model_.light(lamp).clipped) result.insert(result.end(), {3, 4, 5});
    return result;
  }
  const std::vector<std::size_t>& free() const { return free_; }  ///< indices of all unknowns that are not fixed
  /// Difference of log albedo over pair_scale; its squared norm is the mean of squares over the channels.
  Eigen::Vector3f residual(const SamplePair& pair) const {
    return kChannelScale *
           (log_albedo[static_cast<std::size_t>(pair.a)] - log_albedo[static_cast<std::size_t>(pair.b)]);
  }
  /// Weight of each pair by what its samples say of the light, 0 to 1: nothing below the noise floor.
  std::vector<double> information(const std::vector<SamplePair>& pairs) const {
    std::vector<float> of_sample(log_albedo.size(), 1.0f);  // known albedo: all
    for (std::size_t i = 0; i < model_.samples(); ++i) of_sample[i] = model_.information_weight(i, powers_, factors_);
    std::vector<double> result;
    for (const SamplePair& pair : pairs)
      result.push_back(std::pow(
          std::min(of_sample[static_cast<std::size_t>(pair.a)], of_sample[static_cast<std::size_t>(pair.b)]), 2.0f));
    return result;
  }
  const ShadingModel& model() const { return model_; }
  std::size_t lamps() const { return shapes_.size(); }
  Eigen::Index size() const { return static_cast<Eigen::Index>(unknowns_.size()); }
  double* of_lamp(std::size_t lamp) { return &unknowns_[kUnknownsPerLamp * lamp]; }
  Eigen::Map<const Eigen::VectorXd> unknowns() const { return {unknowns_.data(), size()}; }

  std::vector<Eigen::Array3f> log_albedo;
  std::vector<std::vector<Eigen::Array3f>> derivative;  ///< per unknown, per sample

 private:
  void differentiate() {
    std::vector<Eigen::Array3f> slope(model_.samples());
    for (std::size_t i = 0; i < slope.size(); ++i) slope[i] = model_.slope(i, powers_, factors_);
    derivative.assign(unknowns_.size(), std::vector<Eigen::Array3f>(log_albedo.size(), Eigen::Array3f::Zero()));
    std::vector<float> ahead, behind;
    for (const std::size_t p : free_) {
      const std::size_t lamp = p / kUnknownsPerLamp;
      const int unknown = static_cast<int>(p % kUnknownsPerLamp);
      if (unknown >= 3) {
        const int c = unknown - 3;
        for (std::size_t i = 0; i < slope.size(); ++i)
          derivative[p][i][c] = powers_[lamp][c] * factors_[lamp][i] * slope[i][c];
        continue;
      }
      const double value = unknowns_[p];
      unknowns_[p] = value + kPosterior.step;
      model_.factors(lamp, shape(lamp), ahead);
      unknowns_[p] = value - kPosterior.step;
      model_.factors(lamp, shape(lamp), behind);
      unknowns_[p] = value;
      for (std::size_t i = 0; i < ahead.size(); ++i) {
        const float change = (ahead[i] - behind[i]) / static_cast<float>(2 * kPosterior.step);
        if (change != 0) derivative[p][i] = change * powers_[lamp] * slope[i];
      }
    }
    derivatives_done_ = true;
  }

  const ShadingModel& model_;
  std::vector<LampShape> shapes_;
  std::vector<double> unknowns_;
  std::vector<std::size_t> free_;
  std::vector<Eigen::Array3f> powers_;
  std::vector<std::vector<float>> factors_;
  bool derivatives_done_ = false;
};

/// Σ w |r|² over pairs, linearized in the free unknowns.
struct NormalEquations {
  Eigen::MatrixXd curvature;  ///< Jᵀ W J
  Eigen::VectorXd gradient;   ///< Jᵀ W r
};

/// w = (a / (a + |r|²))², the slope of the robust cost, squared, times a factor per pair (none: 1).
///
/// With D the derivatives of the samples' log albedo, a column per sample, and L the Laplacian matrix of the graph
/// whose edges are the weighted pairs, the curvature is D L Dᵀ: its cost grows with the unknowns squared times the
/// samples, which are a tenth of the pairs.
NormalEquations normal_equations(const Evaluation& evaluation, const std::vector<SamplePair>& pairs, double level,
                                 const std::vector<double>& factors = {}) {
  constexpr Eigen::Index kSamplesAtOnce = 128;  // sums of these are floats
  const std::vector<std::size_t>& free = evaluation.free();
  const auto size = static_cast<Eigen::Index>(free.size()),
             samples = static_cast<Eigen::Index>(evaluation.model().samples());
  NormalEquations sum{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  Eigen::VectorXf weights(static_cast<Eigen::Index>(pairs.size()));
  Eigen::Matrix3Xf pulls = Eigen::Matrix3Xf::Zero(3, samples);  // L times log albedo
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3f r = evaluation.residual(pairs[i]);
    const double slope = level / (level + r.squaredNorm()), factor = factors.empty() ? 1 : factors[i];
    const auto weight = static_cast<float>(pairs[i].weight * factor * slope * slope);
    weights[static_cast<Eigen::Index>(i)] = kChannelScale * kChannelScale * weight;
    pulls.col(pairs[i].a) += kChannelScale * weight * r;
    if (pairs[i].b < samples) pulls.col(pairs[i].b) -= kChannelScale * weight * r;
  }
  for (Eigen::Index c = 0; c < 3; ++c) {
    std::vector<Eigen::Index> own;  // free unknowns on which this channel depends
    for (Eigen::Index k = 0; k < size; ++k) {
      const std::size_t unknown = free[static_cast<std::size_t>(k)] % kUnknownsPerLamp;
      if (unknown < 3 || unknown == 3 + static_cast<std::size_t>(c)) own.push_back(k);
    }
    const auto count = static_cast<Eigen::Index>(own.size());
    Eigen::MatrixXf slopes(count, samples), laplacian = Eigen::MatrixXf::Zero(count, samples);  // D, and D L
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto& derivative = evaluation.derivative[free[static_cast<std::size_t>(own[static_cast<std::size_t>(k)])]];
      for (Eigen::Index i = 0; i < samples; ++i) slopes(k, i) = derivative[static_cast<std::size_t>(i)][c];
    }
    Eigen::VectorXf difference(count);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Eigen::Index a = pairs[i].a, b = pairs[i].b;
      difference = slopes.col(a);
      if (b < samples) difference -= slopes.col(b);
      difference *= weights[static_cast<Eigen::Index>(i)];
      laplacian.col(a) += difference;
      if (b < samples) laplacian.col(b) -= difference;
    }
    Eigen::MatrixXd product = Eigen::MatrixXd::Zero(count, count);
    Eigen::VectorXd along = Eigen::VectorXd::Zero(count);
    for (Eigen::Index first = 0; first < samples; first += kSamplesAtOnce) {
      const Eigen::Index columns = std::min(kSamplesAtOnce, samples - first);
      const auto here = slopes.middleCols(first, columns);
      product += (laplacian.middleCols(first, columns) * here.transpose()).cast<double>();
      along += (here * pulls.row(c).segment(first, columns).transpose()).cast<double>();
    }
    sum.curvature(own, own) += 0.5 * (product + product.transpose());
    sum.gradient(own) += along;
  }
  return sum;
}

/// Mean squared residual of the pairs that agree: of all, of adjacent samples, and of samples apart.
struct Misfit {
  double all = 0, adjacent = 0, apart = 0;
};

/// `information`: of each pair.
Misfit misfit_of(const Evaluation& evaluation, const std::vector<SamplePair>& pairs,
                 const std::vector<double>& information) {
  struct Mean {
    double sum = 0, weights = 1e-9;
  } adjacent, apart;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double s = evaluation.residual(pairs[i]).squaredNorm();
    const double weight = pairs[i].weight * information[i] / ((1 + s) * (1 + s));
    Mean& mean = pairs[i].adjacent ? adjacent : apart;
    mean.sum += weight * s;
    mean.weights += weight;
  }
  return {(adjacent.sum + apart.sum) / (adjacent.weights + apart.weights), adjacent.sum / adjacent.weights,
          apart.sum / apart.weights};
}

/// v. What adjacent samples differ by is each sample's own (the nugget effect: Cressie 1993, section 2.3): it averages
/// out over samples, and the pairs of one sample share it. The rest of what samples apart differ by, at most what all
/// pairs do and at least the model's own error, is common to as many pairs as share one error.
double variance_of(const Misfit& misfit) {
  const double min_square = std::pow(kPosterior.model_error / kPosterior.pair_scale, 2);
  const double own = std::min(misfit.adjacent, misfit.apart),
               common = std::max(min_square, std::min(misfit.all, misfit.apart - own));
  return kPosterior.pairs_per_observation * common / 3 + kPosterior.pairs_per_sample * own;
}

/// A cost of all lamps' unknowns.
class LampCost : public ceres::CostFunction {
 public:
  LampCost(const Evaluation& evaluation, Eigen::Index residuals) {
    set_num_residuals(static_cast<int>(residuals));
    mutable_parameter_block_sizes()->assign(evaluation.lamps(), kUnknownsPerLamp);
  }

 protected:
  /// `jacobian`: a column for each unknown.
  void write(const Eigen::MatrixXd& jacobian, double** blocks) const {
    using Block = Eigen::Matrix<double, Eigen::Dynamic, kUnknownsPerLamp, Eigen::RowMajor>;
    for (std::size_t lamp = 0; lamp < parameter_block_sizes().size(); ++lamp)
      if (blocks[lamp])
        Eigen::Map<Block>(blocks[lamp], num_residuals(), kUnknownsPerLamp) =
            jacobian.middleCols<kUnknownsPerLamp>(first_of(lamp));
  }
};

/// 1/v Σ a s / (a + s) over all pairs with level a. Ceres gets as many residuals as there are free unknowns, and one
/// more, whose cost, gradient and curvature are those of all pairs together, each weighted with the slope of its robust
/// cost (Triggs et al. 2000, section 4.3). Thousands of residuals of their own would take ten times as long.
class PairsCost : public LampCost {
 public:
  PairsCost(const Evaluation& evaluation, const std::vector<SamplePair>& pairs, double level, double variance)
      : LampCost(evaluation, static_cast<Eigen::Index>(evaluation.free().size()) + 1),
        evaluation_(evaluation),
        pairs_(pairs),
        level_(level),
        variance_(variance) {}

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const auto size = static_cast<Eigen::Index>(evaluation_.free().size());
    Eigen::Map<Eigen::VectorXd> reduced(residuals, size + 1);
    reduced.setZero();
    const double cost = robust_cost(evaluation_.log_albedo, pairs_, level_) / variance_;
    if (jacobians) {
      const NormalEquations sum = normal_equations(evaluation_, pairs_, level_);
      // Jᵀ J = V D Vᵀ: the reduced Jacobian is √D Vᵀ.
      const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(sum.curvature / variance_);
      const Eigen::VectorXd root = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
      const Eigen::VectorXd along = eigen.eigenvectors().transpose() * sum.gradient / variance_;
      for (Eigen::Index k = 0; k < size; ++k)
        if (root[k] > kMinRelativeRoot * root[size - 1]) reduced[k] = along[k] / root[k];
      Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(size + 1, evaluation_.size());
      jacobian(Eigen::seqN(0, size), evaluation_.free()) = root.asDiagonal() * eigen.eigenvectors().transpose();
      write(jacobian, jacobians);
    }
    reduced[size] = std::sqrt(std::max(0.0, cost - reduced.squaredNorm()));
    return true;
  }

 private:
  static constexpr double kMinRelativeRoot = 1e-9;  // below it a direction has no influence but rounding

  const Evaluation& evaluation_;
  const std::vector<SamplePair>& pairs_;
  double level_, variance_;
};

/// Prior of the scale of albedo, of white paper or, loosely, of the mean of a room.
struct ScalePrior {
  double albedo, log_sigma;
};
ScalePrior scale_prior(int paper) {
  return paper >= 0 ? ScalePrior{kPosterior.paper_albedo, kPosterior.paper_log_sigma}
                    : ScalePrior{kPosterior.room_albedo, kPosterior.room_log_sigma};
}
/// If all visible lamps are measured, the mean of a room does not help to find the power of unseen lamps; paper does.
bool needs_scale_prior(const ShadingModel& model, int paper) {
  if (has_clipped(model)) return true;
  for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp)
    if (model.light(lamp).clipped) return paper >= 0;
  return false;
}

class ScaleCost : public LampCost {
 public:
  ScaleCost(const Evaluation& evaluation, int paper)
      : LampCost(evaluation, 3), evaluation_(evaluation), paper_(paper) {}

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const ScalePrior prior = scale_prior(paper_);
    const Eigen::Array3f found = evaluation_.model().scale_reference(evaluation_.log_albedo, paper_);
    for (int c = 0; c < 3; ++c) residuals[c] = (found[c] - std::log(prior.albedo)) / prior.log_sigma;
    if (jacobians) write(rows(evaluation_, paper_), jacobians);
    return true;
  }
  static Eigen::MatrixXd rows(const Evaluation& evaluation, int paper) {
    Eigen::MatrixXd result(3, evaluation.size());
    for (Eigen::Index p = 0; p < result.cols(); ++p) {
      const auto& derivative = evaluation.derivative[static_cast<std::size_t>(p)];
      result.col(p) = evaluation.model().scale_reference(derivative, paper).matrix().cast<double>();
    }
    return result / scale_prior(paper).log_sigma;
  }

 private:
  const Evaluation& evaluation_;
  int paper_;
};

class LinearCost : public LampCost {
 public:
  LinearCost(const Evaluation& evaluation, LinearRows rows)
      : LampCost(evaluation, rows.a.rows()), evaluation_(evaluation), rows_(std::move(rows)) {}
  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = rows_.a * evaluation_.unknowns() - rows_.b;
    if (jacobians) write(rows_.a, jacobians);
    return true;
  }

 private:
  const Evaluation& evaluation_;
  LinearRows rows_;
};

/// Bounds of one lamp's unknowns.
void bound(ceres::Problem& problem, Evaluation& evaluation, std::size_t lamp) {
  double* p = evaluation.of_lamp(lamp);
  const std::vector<int> known = evaluation.fixed(lamp);
  if (known.size() == kUnknownsPerLamp) return problem.SetParameterBlockConstant(p);
  for (int i = 0; i < kUnknownsPerLamp; ++i) {
    if (std::count(known.begin(), known.end(), i)) continue;
    problem.SetParameterLowerBound(p, i, i == 0 || i >= 3 ? 0 : -kPosterior.max_tilt);
    problem.SetParameterUpperBound(p, i,
                                   i == 0  ? 1 / kPosterior.min_distance_m
                                   : i < 3 ? kPosterior.max_tilt
                                           : std::log(kPosterior.max_gain));
  }
  if (!known.empty()) problem.SetManifold(p, new ceres::SubsetManifold(kUnknownsPerLamp, known));
}

void minimise(ceres::Problem& problem, Search how) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = how == Search::fine ? kPosterior.fine_iterations : kPosterior.rough_iterations;
  options.function_tolerance = how == Search::fine ? kPosterior.fine_tolerance : kPosterior.rough_tolerance;
  // Bounds make Ceres search along each step: from costs alone, since derivatives are the expensive part.
  options.line_search_interpolation_type = ceres::QUADRATIC;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
}

/// Log gains of unseen lamps that are nearly off differ much without any effect: their information is that at log_dim.
void scale_dim_lamps(const Evaluation& evaluation, Eigen::MatrixXd& information) {
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) {
    if (evaluation.model().light(lamp).visibility == PointLight::Visibility::visible) continue;
    const LampShape shape = evaluation.shape(lamp);
    for (int c = 0; c < 3; ++c) {
      const double scale = std::exp(std::max(0.0, kPosterior.log_dim - shape.log_gain[static_cast<std::size_t>(c)]));
      information.row(first_of(lamp) + 3 + c) *= scale;
      information.col(first_of(lamp) + 3 + c) *= scale;
    }
  }
}

}  // namespace

double LampPosterior::log_ceiling_prior(const PointLight& light, std::size_t lamp) const {
  const double away = (shapes[lamp].inverse_distance - usual_inverse_distance(light)) / kPosterior.inverse_height_scale;
  const double width = inverse_distance_sigma(lamp) * std::sqrt(2 / std::numbers::pi) / kPosterior.inverse_height_scale;
  return kPosterior.ceiling_log_odds + std::log(width / (1 + away * away));
}
double LampPosterior::inverse_distance_sigma(std::size_t lamp) const {
  return std::sqrt(std::max(0.0, covariance(first_of(lamp), first_of(lamp))));
}
double LampPosterior::gain_log_sigma(std::size_t lamp) const {
  return std::sqrt(std::max(0.0, covariance.diagonal().segment<3>(first_of(lamp) + 3).mean()));
}

double robust_cost(const std::vector<Eigen::Array3f>& log_albedo, const std::vector<SamplePair>& pairs, double level,
                   double limit) {
  constexpr std::size_t kPairsBetweenChecks = 64;
  constexpr float kScale = kChannelScale * kChannelScale;
  const auto of = static_cast<float>(level);
  double sum = 0;
  for (std::size_t i = 0; i < pairs.size() && sum <= limit;) {
    for (const std::size_t end = std::min(pairs.size(), i + kPairsBetweenChecks); i < end; ++i) {
      const SamplePair& pair = pairs[i];
      const Eigen::Array3f d =
          log_albedo[static_cast<std::size_t>(pair.a)] - log_albedo[static_cast<std::size_t>(pair.b)];
      const float squared = kScale * d.square().sum();
      sum += static_cast<double>(pair.weight * of * squared / (of + squared));
    }
  }
  return sum;
}

bool has_clipped(const ShadingModel& model) {
  for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp)
    if (model.light(lamp).clipped && model.light(lamp).visibility == PointLight::Visibility::visible) return true;
  return false;
}

double albedo_scale_cost(const ShadingModel& model, const std::vector<Eigen::Array3f>& log_albedo, int paper) {
  if (!needs_scale_prior(model, paper)) return 0;
  const ScalePrior prior = scale_prior(paper);
  const Eigen::Array3f error = model.scale_reference(log_albedo, paper) - static_cast<float>(std::log(prior.albedo));
  return error.square().sum() / (prior.log_sigma * prior.log_sigma);
}

LampPosterior solve_lamps(const ShadingModel& model, const std::vector<SamplePair>& pairs, int paper,
                          const std::vector<LampShape>& start, Search how, const LampPrior* prior) {
  Evaluation evaluation(model, start);
  evaluation.PrepareForEvaluation(false, true);
  LampPosterior result;
  result.pair_variance = variance_of(misfit_of(evaluation, pairs, evaluation.information(pairs)));
  ceres::Problem::Options options;
  options.evaluation_callback = &evaluation;
  ceres::Problem problem(options);
  std::vector<double*> blocks;
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) blocks.push_back(evaluation.of_lamp(lamp));
  const double level = how == Search::fine ? 1 : kPosterior.wide_level;
  problem.AddResidualBlock(new PairsCost(evaluation, pairs, level, result.pair_variance), nullptr, blocks);
  const bool with_scale = needs_scale_prior(model, paper);
  if (with_scale) problem.AddResidualBlock(new ScaleCost(evaluation, paper), nullptr, blocks);
  LinearRows linear(evaluation.size());
  add_wide_rows(model, linear);
  add_alike_rows(model, start, linear);
  problem.AddResidualBlock(new LinearCost(evaluation, linear), nullptr, blocks);
  const std::vector<LinearRows> heights = height_rows(model, start);
  for (const LinearRows& row : heights)
    problem.AddResidualBlock(new LinearCost(evaluation, row), new ceres::CauchyLoss(1), blocks);
  if (prior)
    for (const LinearRows& row : prior->intensities)
      problem.AddResidualBlock(new LinearCost(evaluation, row),
                               new ceres::CauchyLoss(kLampParameters.memory.changed_sigmas), blocks);
  // What contradicts the earlier solutions wins in the end: their weight falls with the difference.
  if (prior)
    problem.AddResidualBlock(new LinearCost(evaluation, prior_rows(*prior)),
                             new ceres::CauchyLoss(kPosterior.contradiction_sigmas), blocks);
  for (std::size_t lamp = 0; lamp < evaluation.lamps(); ++lamp) bound(problem, evaluation, lamp);
  minimise(problem, how);

  evaluation.PrepareForEvaluation(true, true);
  result.shapes = evaluation.shapes();
  result.cost = robust_cost(evaluation.log_albedo, pairs) +
                result.pair_variance * albedo_scale_cost(model, evaluation.log_albedo, paper);
  const std::vector<double> information = evaluation.information(pairs);
  const Misfit misfit = misfit_of(evaluation, pairs, information);
  result.misfit = kPosterior.pair_scale * std::sqrt(misfit.all);
  const NormalEquations sum = normal_equations(evaluation, pairs, 1, information);
  result.information = Eigen::MatrixXd::Zero(evaluation.size(), evaluation.size());
  result.information(evaluation.free(), evaluation.free()) = sum.curvature / variance_of(misfit);
  if (with_scale) {
    const Eigen::MatrixXd rows = ScaleCost::rows(evaluation, paper);
    result.information += rows.transpose() * rows;
  }
  scale_dim_lamps(evaluation, result.information);
  result.information += linear.a.transpose() * linear.a;
  for (const LinearRows& row : heights)
    result.information += row.a.transpose() * row.a / (1 + (row.a * evaluation.unknowns() - row.b).squaredNorm());
  result.covariance = result.information.inverse();
  result.with_prior = result.information;
  if (prior) {
    const Eigen::VectorXd off = evaluation.unknowns() - prior->mean;
    const double contradiction = off.dot(prior->information * off) / std::pow(kPosterior.contradiction_sigmas, 2);
    result.with_prior += prior->information / (1 + contradiction);
    for (const LinearRows& row : prior->intensities) {
      const double sigmas = (row.a * evaluation.unknowns() - row.b).norm() / kLampParameters.memory.changed_sigmas;
      result.with_prior += row.a.transpose() * row.a / (1 + sigmas * sigmas);
    }
  }
  return result;
}

}  // namespace lumigraft::reconstruct
