#include "reconstruct/pose/tag_map.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <cmath>
#include <utility>

#include "capture/message_text.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Step = Eigen::Matrix<double, 6, 1>;
using Square = Eigen::Matrix<double, 6, 6>;

/// Steps δ_a and δ_b from the poses of two tags, or of one: (step_between(T_a T_a_b, T_b)) / σ. The pairs' poses hardly
/// differ from the map's, so the derivatives at δ = 0 hold.
class PairResidual : public ceres::SizedCostFunction<6, 6, 6> {
 public:
  PairResidual(const Isometry3d& T_world_a, const Isometry3d& T_world_b, const Isometry3d& T_a_b, const Step& sigma)
      : T_world_a_(T_world_a), T_world_b_(T_world_b), T_a_b_(T_a_b), weight_(sigma.cwiseInverse()) {}

  bool Evaluate(double const* const* steps, double* residuals, double** jacobians) const override {
    const Isometry3d a = apply_step(T_world_a_, Eigen::Map<const Step>(steps[0]));
    const Isometry3d b = apply_step(T_world_b_, Eigen::Map<const Step>(steps[1]));
    const Step difference = step_between(a * T_a_b_, b);
    // In the frame of a, in which the pair was measured.
    const Eigen::Matrix3d to_a = a.linear().transpose();
    Eigen::Map<Step> residual(residuals);
    residual.head<3>() = to_a * difference.head<3>();
    residual.tail<3>() = to_a * difference.tail<3>();
    residual = residual.cwiseProduct(weight_);
    if (!jacobians) return true;
    Square of_a = Square::Zero(), of_b = Square::Zero();
    of_a.topLeftCorner<3, 3>() = of_a.bottomRightCorner<3, 3>() = -to_a;
    of_a.topRightCorner<3, 3>() = -to_a * cross_with(a.linear() * T_a_b_.translation());
    of_b.topLeftCorner<3, 3>() = of_b.bottomRightCorner<3, 3>() = to_a;
    for (const auto& [jacobian, values] : {std::pair(jacobians[0], &of_a), std::pair(jacobians[1], &of_b)}) {
      if (!jacobian) continue;
      Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> rows(jacobian);
      rows = weight_.asDiagonal() * *values;
    }
    return true;
  }

 private:
  Isometry3d T_world_a_, T_world_b_, T_a_b_;
  Step weight_;
};

Step sigmas(double position_m, double angle_rad) {
  Step result;
  result << Eigen::Vector3d::Constant(position_m), Eigen::Vector3d::Constant(angle_rad);
  return result;
}

}  // namespace

bool contradicts(const Step& step, const Step& sigma) {
  return step.head<3>().norm() > kTagMap.moved_m + kTagMap.moved_sigmas * sigma.head<3>().norm() ||
         step.tail<3>().norm() > kTagMap.moved_rad + kTagMap.moved_sigmas * sigma.tail<3>().norm();
}

bool TagMap::Pair::known() const { return count >= kTagMap.min_sightings; }

Step TagMap::Pair::sigma_of_one() const {
  return known() ? Step((squares / (count - 1.0)).cwiseSqrt()) : Step(Step::Constant(kTagMap.moved_m));
}

Step TagMap::Pair::sigma_of_mean() const {
  const Step variance = squares / (count - 1.0) / count;
  return sigmas(std::hypot(kTagMap.min_sigma_m, std::sqrt(variance.head<3>().sum() / 3)),
                std::hypot(kTagMap.min_sigma_rad, std::sqrt(variance.tail<3>().sum() / 3)));
}

TagMap::TagMap(const capture::Tag& tag) : moves_exhibit_(tag.moves_exhibit) {
  state_.tags.push_back({.id = tag.id, .configured = {}, .held = {}, .T_world_tag = Isometry3d::Identity()});
  const Step sigma = sigmas(kTagMap.configured_sigma_m, kTagMap.configured_sigma_rad);
  for (const capture::ExtraTag& extra : tag.extra)
    state_.tags.push_back({.id = extra.id,
                           .configured = extra.T_tag_extra,
                           .held = extra.T_tag_extra,
                           .T_world_tag = extra.T_tag_extra,
                           .covariance = Square(sigma.cwiseAbs2().asDiagonal())});
}

PoseCovariance TagMap::uncertainty(std::size_t tag, const Isometry3d& T_camera_tag) const {
  // A camera turns about the tag with the tag's error.
  const Tag& known = state_.tags[tag];
  const Eigen::Vector3d arm = known.T_world_tag->linear() * T_camera_tag.inverse().translation();
  Square j = Square::Identity();
  j.topRightCorner<3, 3>() = cross_with(arm);
  return j * known.covariance * j.transpose();
}

void TagMap::add_pair(std::size_t a, std::size_t b, const Isometry3d& T_a_b) {
  Pair& pair = state_.pairs[{a, b}];
  if (pair.count > 0) {
    pair.contradicting = contradicts(step_between(pair.mean, T_a_b), pair.sigma_of_one()) ? pair.contradicting + 1 : 0;
    if (pair.contradicting > 0 && pair.contradicting < kTagMap.moved_sightings) return;
  }
  if (pair.contradicting >= kTagMap.moved_sightings) {
    // The later of both was moved.
    state_.tags[b].T_world_tag.reset();
    forget_pairs(b);
    state_.pairs[{a, b}] = {.mean = T_a_b, .count = 1};
    ++version_;
    return;
  }
  // Welford's running mean and sum of squares with a limited count.
  if (pair.count == kTagMap.max_sightings) {
    pair.squares *= (kTagMap.max_sightings - 1.0) / kTagMap.max_sightings;
    --pair.count;
  }
  ++pair.count;
  if (pair.count == 1) pair.mean = T_a_b;
  const Step before = step_between(pair.mean, T_a_b);
  pair.mean = apply_step(pair.mean, before / pair.count);
  pair.squares += before.cwiseProduct(step_between(pair.mean, T_a_b));
  if (!pair.known() || pair.count < kTagMap.optimize_growth * pair.optimized) return;
  locate_by_chains();
  optimize();
}

bool TagMap::contradicts_pair(std::size_t a, std::size_t b, const Isometry3d& T_a_b) const {
  const auto pair = state_.pairs.find({a, b});
  return pair != state_.pairs.end() && pair->second.known() &&
         contradicts(step_between(pair->second.mean, T_a_b), pair->second.sigma_of_mean());
}

/// First poses of tags that are not located, along pairs from those that are.
void TagMap::locate_by_chains() {
  for (bool found = true; found;) {
    found = false;
    for (const auto& [ab, pair] : state_.pairs) {
      Tag &a = state_.tags[ab.first], &b = state_.tags[ab.second];
      if (!pair.known() || a.T_world_tag.has_value() == b.T_world_tag.has_value()) continue;
      if (a.T_world_tag)
        b.T_world_tag = *a.T_world_tag * pair.mean;
      else
        a.T_world_tag = *b.T_world_tag * pair.mean.inverse();
      found = true;
    }
  }
}

void TagMap::optimize() {
  ++version_;
  std::vector<Step> steps(state_.tags.size(), Step::Zero());
  Step world = Step::Zero();
  ceres::Problem problem;
  problem.AddParameterBlock(world.data(), 6);
  problem.SetParameterBlockConstant(world.data());
  const auto add = [&](const Isometry3d& T_world_a, Step& a, std::size_t b, const Isometry3d& T_a_b, const Step& sigma,
                       ceres::LossFunction* loss) {
    // NOLINTNEXTLINE(cppcoreguidelines-owning-memory): the problem owns it
    auto* residual = new PairResidual(T_world_a, *state_.tags[b].T_world_tag, T_a_b, sigma);
    problem.AddResidualBlock(residual, loss, a.data(), steps[b].data());
  };
  for (auto& [ab, pair] : state_.pairs) {
    if (!pair.known() || !state_.tags[ab.first].T_world_tag || !state_.tags[ab.second].T_world_tag) continue;
    pair.optimized = pair.count;
    state_.tags[ab.first].seen_from_others = state_.tags[ab.second].seen_from_others = true;
    add(*state_.tags[ab.first].T_world_tag, steps[ab.first], ab.second, pair.mean, pair.sigma_of_mean(), nullptr);
  }
  const Step held_sigma = sigmas(kTagMap.configured_sigma_m, kTagMap.configured_sigma_rad);
  for (std::size_t t = 1; t < state_.tags.size(); ++t)
    if (state_.tags[t].held && problem.HasParameterBlock(steps[t].data()))  // a wrong one must not pull: robust
      add(Isometry3d::Identity(), world, t, *state_.tags[t].held, held_sigma, new ceres::CauchyLoss(1));
  if (problem.HasParameterBlock(steps[0].data())) problem.SetParameterBlockConstant(steps[0].data());
  ceres::Solver::Options options;
  options.logging_type = ceres::SILENT;
  options.linear_solver_type = ceres::DENSE_QR;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  ceres::Covariance covariance{ceres::Covariance::Options()};
  std::vector<std::pair<const double*, const double*>> blocks;
  for (std::size_t t = 1; t < state_.tags.size(); ++t)
    if (problem.HasParameterBlock(steps[t].data())) blocks.emplace_back(steps[t].data(), steps[t].data());
  const bool computed = !blocks.empty() && covariance.Compute(blocks, &problem);
  for (std::size_t t = 1; t < state_.tags.size(); ++t) {
    if (!problem.HasParameterBlock(steps[t].data())) continue;
    state_.tags[t].T_world_tag = apply_step(*state_.tags[t].T_world_tag, steps[t]);
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> of_tag;
    if (computed && covariance.GetCovarianceBlock(steps[t].data(), steps[t].data(), of_tag.data()))
      state_.tags[t].covariance = of_tag;
  }
}

void TagMap::move(std::size_t tag, const Isometry3d& T_world_tag) {
  state_.tags[tag].moved_m += (T_world_tag.translation() - state_.tags[tag].T_world_tag->translation()).norm();
  state_.tags[tag].T_world_tag = T_world_tag;
  forget_pairs(tag);
  ++version_;
}

/// All tags stay where they are, although nothing may connect them with the first one any more.
void TagMap::forget_pairs(std::size_t tag) {
  std::erase_if(state_.pairs, [&](const auto& pair) { return pair.first.first == tag || pair.first.second == tag; });
  for (Tag& each : state_.tags) each.held = each.T_world_tag;
}

std::string TagMap::warning(std::size_t tag) const {
  const Tag& known = state_.tags[tag];
  if (!known.T_world_tag) return capture::formatted("tag %d: not used until it is seen together with others", known.id);
  if (known.moved_m > 0)
    return capture::formatted("tag %d: it was moved by %.0f mm, objects %s", known.id, 1e3 * known.moved_m,
                              tag == 0 && moves_exhibit_ ? "moved with it" : "stay where they were");
  if (!known.configured || !known.seen_from_others) return {};
  const Step difference = step_between(*known.configured, *known.T_world_tag);
  if (!contradicts(difference, known.covariance.diagonal().cwiseSqrt())) return {};
  return capture::formatted("tag %d: is %.0f mm and %.1f degrees from its configured pose", known.id,
                            1e3 * difference.head<3>().norm(), difference.tail<3>().norm() * 180 / M_PI);
}

}  // namespace lumigraft::reconstruct
