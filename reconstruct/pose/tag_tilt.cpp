#include "reconstruct/pose/tag_tilt.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/message_text.h"
#include "reconstruct/math/planar_pose.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Step = Eigen::Matrix<double, 6, 1>;

/// A step (δp, δθ) of the camera's pose moves the print's normal, as the camera sees it, by (-δθy, δθx) in the tag
/// frame.
Eigen::Matrix<double, 2, 6> normal_by_step() {
  Eigen::Matrix<double, 2, 6> by_step = Eigen::Matrix<double, 2, 6>::Zero();
  by_step(0, 4) = -1;
  by_step(1, 3) = 1;
  return by_step;
}

}  // namespace

/// Whether the largest bias of a print does not explain the difference either.
bool TagTilt::contradicts(const TiltDifference& difference, const PoseCandidate& candidate) const {
  const double bias_px = kTagPose.bias_sigma_px * std::pow(2.0, kTagTilt.nodes);
  const Matrix2d largest = bias_px * bias_px * normal_by_step() *
                           square_covariance(candidate.T_camera_tag, size_m_, 1 / focal_px_) *
                           normal_by_step().transpose();
  const Matrix2d innovation = largest + difference.covariance;
  return difference.normal_xy.dot(innovation.inverse() * difference.normal_xy) >
         kTagTilt.contradiction_sigmas * kTagTilt.contradiction_sigmas;
}

void TagTilt::correct(PoseCandidate& candidate, const std::optional<SurroundingPlane>& plane) const {
  TiltDifference difference = mean_;
  if (plane) {
    const Eigen::Matrix3d to_tag = candidate.T_camera_tag.linear().transpose();
    const Eigen::Vector3d normal = to_tag * plane->normal;
    if (!(normal.z() > 0)) return;  // the other of the two poses, or no surface of this tag
    difference = {normal.head<2>(), (to_tag * plane->covariance * to_tag.transpose()).topLeftCorner<2, 2>()};
    if (contradicts(difference, candidate)) {
      candidate.contradicted_rad = std::acos(std::min(normal.z(), 1.0));
      return;
    }
    candidate.tilt_by_depth = difference;
  } else if (count_ == 0) {
    return;
  }

  const Eigen::Matrix<double, 2, 6> by_step = normal_by_step();
  const PoseCovariance of_a_pixel = square_covariance(candidate.T_camera_tag, size_m_, 1 / focal_px_);
  std::vector<double> log_weights;
  std::vector<Step> steps;
  std::vector<PoseCovariance> covariances;
  for (int node = 0; node <= kTagTilt.nodes; ++node) {
    const double bias_px = kTagPose.bias_sigma_px * std::pow(2.0, node);
    const PoseCovariance prior = node == 0 ? candidate.bias : PoseCovariance(bias_px * bias_px * of_a_pixel);
    const double share = node == 0 ? kTagTilt.flat_probability : (1 - kTagTilt.flat_probability) / kTagTilt.nodes;
    double log_weight = std::log(share);
    const Matrix2d innovation = by_step * prior * by_step.transpose() + difference.covariance;
    const Matrix2d inverse = innovation.inverse();
    const Eigen::Matrix<double, 6, 2> gain = prior * by_step.transpose() * inverse;
    log_weight -= 0.5 * (std::log(innovation.determinant()) + difference.normal_xy.dot(inverse * difference.normal_xy));
    if (!std::isfinite(log_weight)) return;
    log_weights.push_back(log_weight);
    steps.emplace_back(gain * difference.normal_xy);
    covariances.emplace_back(prior - gain * by_step * prior);
  }
  const double largest = *std::max_element(log_weights.begin(), log_weights.end());
  double weights = 0;
  Step mean = Step::Zero();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double weight = std::exp(log_weights[i] - largest);
    weights += weight;
    mean += weight * steps[i];
  }
  mean /= weights;
  const double flat = std::exp(log_weights[0] - largest) / weights;
  candidate.flat_print = flat > (!flat_ ? kTagTilt.flat_at_first : *flat_ ? kTagTilt.bent : kTagTilt.flat_again);
  if (candidate.flat_print) return;
  candidate.bias.setZero();
  for (std::size_t i = 0; i < steps.size(); ++i)
    candidate.bias += std::exp(log_weights[i] - largest) / weights *
                      (covariances[i] + (steps[i] - mean) * (steps[i] - mean).transpose());
  const Eigen::Isometry3d T_camera_print = candidate.T_camera_tag;
  candidate.T_camera_tag = apply_step(T_camera_print.inverse(), mean).inverse();
  candidate.T_tag_print = candidate.T_camera_tag.inverse() * T_camera_print;
}

void TagTilt::add(const PoseCandidate& candidate) {
  T_tag_print_ = candidate.T_tag_print;
  flat_ = candidate.flat_print;
  contradictions_ = candidate.contradicted_rad > 0 ? contradictions_ + 1 : 0;
  contradicted_rad_ = candidate.contradicted_rad;
  if (!candidate.tilt_by_depth) return;  // no depth
  count_ = std::min(count_ + 1, kTagTilt.max_frames);
  mean_.normal_xy += (candidate.tilt_by_depth->normal_xy - mean_.normal_xy) / count_;
  // Distortion is the same in all frames, so the mean is not known better than one of them.
  mean_.covariance += (candidate.tilt_by_depth->covariance - mean_.covariance) / count_;
}

std::string TagTilt::warning(int id) const {
  if (contradictions_ < kTagTilt.contradictions) return {};
  return capture::formatted(
      "depth: the surface around tag %d is turned by %.0f degrees against its print: is depth that of another camera, "
      "or not registered?",
      id, contradicted_rad_ * 180 / M_PI);
}

}  // namespace lumigraft::reconstruct
