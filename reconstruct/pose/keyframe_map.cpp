#include "reconstruct/pose/keyframe_map.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <utility>

#include "reconstruct/math/rotation_vector.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Step = Eigen::Matrix<double, 6, 1>;

/// A point of the room and where it is seen.
struct Sighting {
  Vector3d position_m;  ///< tag frame
  Vector3d along_m;     ///< 1σ of its position, along the line of sight of the keyframe
  Vector2d ray;         ///< x/z, y/z in the image that is located
  double sigma = 0;     ///< 1σ of `ray`
};

std::optional<Vector2d> ray_of(const capture::CameraModel& camera, const Vector2f& pixel) {
  const auto direction = camera.unproject(pixel.cast<double>());
  if (!direction || !(direction->z() > 0)) return std::nullopt;
  return direction->head<2>() / direction->z();
}

double focal_px(const capture::CameraModel& camera) { return (camera.fx + camera.fy) / 2; }

/// Where the keyframe's points are in an image taken from `T_tag_camera`; NaN: not in it.
std::vector<Vector2f> projected(const Keyframe& view, const Isometry3d& T_tag_camera,
                                const capture::CameraModel& camera) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  const Isometry3d T_camera_view = T_tag_camera.inverse() * view.pose.T_tag_camera;
  std::vector<Vector2f> pixels;
  for (const Vector3f& point_m : view.points_m) {
    const auto pixel = camera.project(T_camera_view * point_m.cast<double>());
    pixels.push_back(pixel && camera.inside(*pixel) ? Vector2f(pixel->cast<float>()) : Vector2f(kNaN, kNaN));
  }
  return pixels;
}

void add_sightings(const Keyframe& view, const ViewFeatures& seen, const std::vector<int>& matches,
                   const capture::CameraModel& camera, const capture::DepthNoise& noise,
                   std::vector<Sighting>& sightings) {
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i] < 0) continue;
    const auto ray = ray_of(camera, seen.pixels[matches[i]]);
    if (!ray) continue;
    const Vector3d point_m = view.points_m[i].cast<double>();
    const double sigma_m = static_cast<double>(noise.axial_sigma_m(view.points_m[i].z()));
    const double sigma_px =
        std::hypot(static_cast<double>(seen.sigma_px[matches[i]]), static_cast<double>(view.features.sigma_px[i]));
    sightings.push_back({view.pose.T_tag_camera * point_m,
                         view.pose.T_tag_camera.linear() * (sigma_m / point_m.z() * point_m), *ray,
                         sigma_px / focal_px(camera)});
  }
}

/// Perspective-n-point in RANSAC.
std::optional<Isometry3d> consistent_pose(const std::vector<Sighting>& sightings, double error) {
  if (static_cast<int>(sightings.size()) < kKeyframes.min_inliers) return std::nullopt;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (const Sighting& s : sightings) {
    points.emplace_back(s.position_m.x(), s.position_m.y(), s.position_m.z());
    rays.emplace_back(s.ray.x(), s.ray.y());
  }
  cv::Mat rotation, translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(points, rays, cv::Mat::eye(3, 3, CV_64F), {}, rotation, translation, false,
                          kKeyframes.ransac_rounds, static_cast<float>(error), kKeyframes.ransac_confidence, inliers,
                          cv::SOLVEPNP_SQPNP) ||
      static_cast<int>(inliers.size()) < kKeyframes.min_inliers)
    return std::nullopt;
  Vector3d omega, shift;
  cv::cv2eigen(rotation, omega);
  cv::cv2eigen(translation, shift);
  const Isometry3d T_camera_tag = isometry(rotation_by(omega), shift);
  return T_camera_tag.matrix().allFinite() ? std::optional(T_camera_tag.inverse()) : std::nullopt;
}

/// Normal equations of one Gauss-Newton step over reprojection errors in σ, with Tukey's biweight.
struct ReprojectionStep {
  PoseCovariance information = PoseCovariance::Zero();
  Step gradient = Step::Zero();
  double weights = 0, squares = 0, inverse_depths = 0;
  int inliers = 0;
  std::map<std::pair<int, int>, Step> blocks;  ///< parts of the gradient by regions of the image

  ReprojectionStep(const std::vector<Sighting>& sightings, const Isometry3d& T_tag_camera) {
    const Eigen::Matrix3d to_camera = T_tag_camera.linear().transpose();
    for (const Sighting& s : sightings) {
      const Vector3d arm = s.position_m - T_tag_camera.translation();
      const Vector3d at = to_camera * arm;
      if (!(at.z() > 0)) continue;
      Eigen::Matrix<double, 2, 3> by_point;
      by_point << 1 / at.z(), 0, -at.x() / (at.z() * at.z()), 0, 1 / at.z(), -at.y() / (at.z() * at.z());
      // Errors of depth move the point in the image as far as the views differ.
      const double by_depth = (by_point * to_camera * s.along_m).norm();
      const double sigma = std::hypot(s.sigma, by_depth);
      const Vector2d residual = (at.head<2>() / at.z() - s.ray) / sigma;
      const double ratio = residual.squaredNorm() / (kKeyframes.gate_sigmas * kKeyframes.gate_sigmas);
      if (ratio >= 1) continue;
      const double weight = (1 - ratio) * (1 - ratio);
      Eigen::Matrix<double, 2, 6> j;
      j << -by_point * to_camera, -by_point * to_camera * cross_with(arm);
      j /= sigma;
      information += weight * j.transpose() * j;
      const Step pull = weight * j.transpose() * residual;
      gradient += pull;
      blocks
          .try_emplace({std::lround(s.ray.x() / kKeyframes.block_rad), std::lround(s.ray.y() / kKeyframes.block_rad)},
                       Step::Zero())
          .first->second += pull;
      weights += weight;
      inverse_depths += weight / at.z();
      squares += weight * residual.squaredNorm();
      ++inliers;
    }
  }
};

std::optional<LocatedView> refined(const std::vector<Sighting>& sightings, Isometry3d T_tag_camera) {
  for (int round = 0; round < kKeyframes.rounds; ++round) {
    const ReprojectionStep at(sightings, T_tag_camera);
    if (at.inliers < kKeyframes.min_inliers) return std::nullopt;
    const Step step = solved(at.information, -at.gradient);
    if (!step.allFinite()) return std::nullopt;
    T_tag_camera = apply_step(T_tag_camera, step);
  }
  const ReprojectionStep at(sightings, T_tag_camera);
  if (at.inliers < kKeyframes.min_inliers ||
      at.inliers < kKeyframes.min_inlier_fraction * static_cast<double>(sightings.size()))
    return std::nullopt;
  // Residuals larger than modelled have their share in the covariance, two coordinates a point, and so have errors that
  // are common to the points of a region, as those of depth and lens are (sandwich estimator, White 1980).
  const double misfit = std::max(1.0, at.squares / (2 * at.weights));
  const PoseCovariance of_points = information_of(at.information);
  PoseCovariance pulls = PoseCovariance::Zero();
  for (const auto& [place, pull] : at.blocks) pulls += pull * pull.transpose();
  const PoseCovariance noise = misfit * of_points + of_points * pulls * of_points;
  LocatedView result{{T_tag_camera, noise}, noise};
  const double distance_m = at.weights / at.inverse_depths;
  result.pose.covariance.diagonal().head<3>().array() += std::pow(kKeyframes.common_rad * distance_m, 2);
  result.pose.covariance.diagonal().tail<3>().array() += std::pow(kKeyframes.common_rad, 2);
  return result;
}

}  // namespace

bool KeyframeMap::shows_nothing_new(const Isometry3d& T_tag_camera, float distance_m) const {
  return std::any_of(views_.begin(), views_.end(), [&](const auto& view) {
    const Step step = step_between(view->pose.T_tag_camera, T_tag_camera);
    return step.head<3>().norm() < kKeyframes.new_view_fraction * static_cast<double>(distance_m) &&
           step.tail<3>().norm() < kKeyframes.new_view_rad;
  });
}

void KeyframeMap::add(const capture::FrameSet& frame, const PoseEstimate& pose) {
  if (!frame.color || !frame.depth) return;
  const capture::Image<float>& depth_m = frame.depth->depth_m;
  if (depth_m.width != camera_.width || depth_m.height != camera_.height) return;
  std::vector<float> known_m;
  for (std::size_t i = 0; i < depth_m.data.size(); i += kKeyframes.depth_stride)
    if (depth_m.data[i] > 0) known_m.push_back(depth_m.data[i]);
  if (known_m.empty()) return;
  std::nth_element(known_m.begin(), known_m.begin() + static_cast<std::ptrdiff_t>(known_m.size() / 2), known_m.end());
  if (shows_nothing_new(pose.T_tag_camera, known_m[known_m.size() / 2])) return;

  const ViewFeatures seen = features_of(*frame.color, camera_);
  Keyframe view;
  view.features.small = seen.small;
  view.pose = pose;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto ray = ray_of(camera_, seen.pixels[i]);
    const int u = static_cast<int>(std::lround(seen.pixels[i].x())),
              v = static_cast<int>(std::lround(seen.pixels[i].y()));
    if (!ray || u < 1 || v < 1 || u + 1 >= depth_m.width || v + 1 >= depth_m.height) continue;
    // Points at rims are on the nearer surface or on the farther one.
    float low_m = depth_m.at(u, v), high_m = low_m;
    for (int y = v - 1; y <= v + 1; ++y)
      for (int x = u - 1; x <= u + 1; ++x) {
        low_m = std::min(low_m, depth_m.at(x, y));
        high_m = std::max(high_m, depth_m.at(x, y));
      }
    if (!(low_m > 0) || high_m - low_m > kKeyframes.rim_fraction * low_m) continue;
    kept.push_back(i);
    view.features.pixels.push_back(seen.pixels[i]);
    view.features.sigma_px.push_back(seen.sigma_px[i]);
    view.points_m.push_back(depth_m.at(u, v) * ray->cast<float>().homogeneous());
  }
  if (static_cast<int>(kept.size()) < kKeyframes.min_inliers) return;
  constexpr int kBytes = ViewFeatures::kDescriptorBytes;
  view.features.descriptors = capture::Image<std::uint8_t>(kBytes, static_cast<int>(kept.size()), 1);
  for (std::size_t i = 0; i < kept.size(); ++i)
    std::copy_n(&seen.descriptors.data[kept[i] * kBytes], kBytes, &view.features.descriptors.data[i * kBytes]);
  ++kept_;
  auto kept_view = std::make_shared<const Keyframe>(std::move(view));
  if (views_.size() < kKeyframes.max_views) {
    views_.push_back(std::move(kept_view));
    used_.push_back(located_);
    return;
  }
  const auto oldest = std::min_element(used_.begin(), used_.end());
  views_[static_cast<std::size_t>(oldest - used_.begin())] = std::move(kept_view);
  *oldest = located_;
}

void KeyframeMap::restore(Views views) {
  views_ = std::move(views);
  used_.assign(views_.size(), located_);
}

/// Views to compare, the most promising first.
std::vector<std::size_t> KeyframeMap::candidates(const ViewFeatures& seen,
                                                 const std::optional<PoseEstimate>& expected) const {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    if (!expected) {
      order.emplace_back(-static_cast<double>(similarity(views_[i]->features, seen)), i);
      continue;
    }
    const Step step = step_between(views_[i]->pose.T_tag_camera, expected->T_tag_camera);
    order.emplace_back(step.head<3>().norm() + step.tail<3>().norm(), i);  // a metre is as far as a radian
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> result;
  for (const auto& [distance, i] : order)
    if (static_cast<int>(result.size()) < kKeyframes.candidates) result.push_back(i);
  return result;
}

std::optional<LocatedView> KeyframeMap::locate(const capture::Frame& color,
                                               const std::optional<PoseEstimate>& expected) {
  if (views_.empty()) return std::nullopt;
  const ViewFeatures seen = features_of(color, camera_);
  const double error = kKeyframes.ransac_error_px / focal_px(camera_);
  std::optional<Isometry3d> T_tag_camera;
  if (expected) {
    T_tag_camera = expected->T_tag_camera;
  } else {
    for (const std::size_t i : candidates(seen, std::nullopt)) {
      std::vector<Sighting> sightings;
      add_sightings(*views_[i], seen, matched_points(views_[i]->features, seen), camera_, noise_, sightings);
      T_tag_camera = consistent_pose(sightings, error);
      if (T_tag_camera) break;
    }
    if (!T_tag_camera) return std::nullopt;
  }
  // Points of all views near the pose.
  std::vector<Sighting> sightings;
  const double reach_px = expected ? kKeyframes.expected_reach_px : kKeyframes.near_reach_px;
  const std::vector<std::size_t> near = candidates(seen, PoseEstimate{*T_tag_camera});
  for (const std::size_t i : near)
    add_sightings(*views_[i], seen,
                  matched_points(views_[i]->features, seen, projected(*views_[i], *T_tag_camera, camera_),
                                 static_cast<float>(reach_px)),
                  camera_, noise_, sightings);
  if (expected) T_tag_camera = consistent_pose(sightings, error);
  auto result = T_tag_camera ? refined(sightings, *T_tag_camera) : std::nullopt;
  if (!result) return std::nullopt;
  ++located_;
  for (const std::size_t i : near) used_[i] = located_;
  result->pose.covariance += views_[near.front()]->pose.covariance;
  return result;
}

}  // namespace lumigraft::reconstruct
