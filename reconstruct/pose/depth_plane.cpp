#include "reconstruct/pose/depth_plane.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/message_text.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

bool inside(const TagCorners& corners, const Vector2d& p) {
  int left = 0, right = 0;
  for (int i = 0; i < 4; ++i) {
    const Vector2d edge = corners[(i + 1) % 4] - corners[i], to_point = p - corners[i];
    (edge.x() * to_point.y() - edge.y() * to_point.x() > 0 ? left : right)++;
  }
  return left == 4 || right == 4;
}

/// Pixels with depth in a box, at most about `max_samples` of them.
struct PlaneSample {
  Vector3d ray;  ///< x/z, y/z, 1
  double inverse_depth;
};

std::vector<PlaneSample> samples_in(const capture::Image<float>& depth_m, const capture::CameraModel& camera,
                                    const Eigen::AlignedBox2d& box) {
  const int left = std::max(0, static_cast<int>(box.min().x())), top = std::max(0, static_cast<int>(box.min().y()));
  const int right = std::min(depth_m.width - 1, static_cast<int>(box.max().x())),
            bottom = std::min(depth_m.height - 1, static_cast<int>(box.max().y()));
  const double pixels = std::max(0, right - left + 1) * static_cast<double>(std::max(0, bottom - top + 1));
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / kSurroundingPlane.max_samples))));
  std::vector<PlaneSample> samples;
  for (int v = top; v <= bottom; v += step)
    for (int u = left; u <= right; u += step) {
      const float z = depth_m.at(u, v);
      const auto direction = z > 0 ? camera.unproject(Vector2d(u, v)) : std::nullopt;
      if (direction && direction->z() > 0)
        samples.push_back({*direction / direction->z(), 1.0 / static_cast<double>(z)});
    }
  return samples;
}

}  // namespace

std::optional<SurroundingPlane> plane_around(const capture::Image<float>& depth_m, const capture::CameraModel& camera,
                                             const TagCorners& corners, const capture::DepthNoise& depth_noise) {
  const auto inside_tag = plane_inside(depth_m, camera, corners);
  if (!inside_tag) return std::nullopt;
  Vector3d plane = inside_tag->inverse_depth;
  const Eigen::AlignedBox2d tag = box_of(corners);
  const Vector2d centre_px = tag.center();
  SurroundingPlane result;
  double angle_sigma_rad = inside_tag->angle_sigma_rad;
  std::optional<double> pixel_noise;  ///< 1σ of inverse depth about the plane so far
  for (double growth = 1; growth <= kSurroundingPlane.max_growth; growth *= kSurroundingPlane.growth) {
    const Eigen::AlignedBox2d box(centre_px - growth * tag.sizes() / 2, centre_px + growth * tag.sizes() / 2);
    const std::vector<PlaneSample> samples = samples_in(depth_m, camera, box);
    const auto middle = camera.unproject(centre_px);
    if (!middle || !(middle->z() > 0)) break;
    const Vector3d middle_ray = *middle / middle->z();
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero(), sum = Vector3d::Zero();
    double count = 0, squares = 0;
    for (const PlaneSample& sample : samples) {
      const double z = 1 / sample.inverse_depth, residual = plane.dot(sample.ray) - sample.inverse_depth;
      // Noise of the pixel, and of the plane that is continued to it.
      const double noise =
          pixel_noise.value_or(static_cast<double>(depth_noise.axial_sigma_m(static_cast<float>(z))) / (z * z));
      const double continued = angle_sigma_rad * plane.norm() * (sample.ray - middle_ray).norm();
      if (std::abs(residual) > kSurroundingPlane.gate_sigmas * std::hypot(noise, continued)) continue;
      moments += sample.ray * sample.ray.transpose();
      right += sample.inverse_depth * sample.ray;
      sum += sample.ray;
      squares += residual * residual;
      ++count;
    }
    if (count < static_cast<double>(kDepthPlane.min_points) ||
        count < kSurroundingPlane.min_share * static_cast<double>(samples.size()))
      break;
    const Eigen::Matrix3d inverse = moments.inverse();
    const Vector3d fitted = inverse * right;
    if (!fitted.allFinite() || !(fitted.norm() > 0)) break;
    const Vector3d mean = sum / count;
    const double noise = kDepthPlane.noise_factor * std::sqrt(squares / count);
    // Distortion bends depth over the extent of the plane: a uniform distribution is √12 σ wide.
    const double distortion = kSurroundingPlane.distortion * fitted.dot(mean) / std::sqrt(12.0);
    // Slopes by x/z and y/z about the mean, where the depth is known best.
    const Eigen::Matrix2d spread = moments.topLeftCorner<2, 2>() / count - mean.head<2>() * mean.head<2>().transpose();
    const Eigen::Matrix2d slopes = (noise * noise / count + distortion * distortion) * spread.inverse();
    Eigen::Matrix<double, 3, 2> by_slope;
    by_slope << 1, 0, 0, 1, -mean.x(), -mean.y();
    const Vector3d normal = -fitted.normalized();
    by_slope = (Eigen::Matrix3d::Identity() - normal * normal.transpose()) * by_slope / fitted.norm();
    const Eigen::Matrix3d covariance = by_slope * slopes * by_slope.transpose();
    // A residual larger than noise and bend: things lie on the surface that are too flat for the gate.
    const double rms = std::sqrt(squares / count);
    if (!covariance.allFinite() || (pixel_noise && rms > std::hypot(*pixel_noise, distortion))) break;
    plane = fitted;
    pixel_noise = rms;
    result = {normal, covariance};
    angle_sigma_rad = std::sqrt(covariance.trace());
    if (box.min().x() <= 0 && box.min().y() <= 0 && box.max().x() >= depth_m.width && box.max().y() >= depth_m.height)
      break;
  }
  if (result.normal.isZero()) return std::nullopt;
  return result;
}

std::optional<DepthPlane> plane_inside(const capture::Image<float>& depth_m, const capture::CameraModel& camera,
                                       const TagCorners& corners) {
  const Vector2d low = box_of(corners).min(), high = box_of(corners).max();
  // On a plane 1/z is affine in x/z and y/z: linear least squares.
  struct Point {
    Vector3d ray;  // x/z, y/z, 1
    double inverse_depth;
  };
  std::vector<Point> points;
  int pixels = 0;
  for (int v = std::max(0, static_cast<int>(low.y())); v <= std::min(depth_m.height - 1.0, high.y()); ++v)
    for (int u = std::max(0, static_cast<int>(low.x())); u <= std::min(depth_m.width - 1.0, high.x()); ++u) {
      if (!inside(corners, Vector2d(u, v))) continue;
      ++pixels;
      const float depth = depth_m.at(u, v);
      const auto direction = camera.unproject(Vector2d(u, v));
      if (depth > 0 && direction && direction->z() > 0)
        points.push_back({*direction / direction->z(), 1.0 / static_cast<double>(depth)});
    }

  Vector3d plane = Vector3d::Zero();
  double sigma = 0;
  Eigen::Matrix3d covariance;
  for (int round = 0; round < kDepthPlane.rounds; ++round) {
    if (points.size() < kDepthPlane.min_points || 2 * static_cast<int>(points.size()) < pixels) return std::nullopt;
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    for (const Point& point : points) {
      a += point.ray * point.ray.transpose();
      b += point.inverse_depth * point.ray;
    }
    covariance = a.inverse();
    plane = covariance * b;
    if (!plane.allFinite() || !(plane.norm() > 0)) return std::nullopt;
    double sum = 0;
    for (const Point& point : points) sum += std::pow(plane.dot(point.ray) - point.inverse_depth, 2);
    sigma = std::sqrt(sum / static_cast<double>(points.size() - 3));
    std::erase_if(points, [&](const Point& point) {
      return std::abs(plane.dot(point.ray) - point.inverse_depth) > kDepthPlane.outlier_sigmas * sigma + 1e-9;
    });
  }
  const double tilt_sigma_rad =
      kDepthPlane.noise_factor * sigma * std::sqrt(covariance.topLeftCorner<2, 2>().trace()) / plane.norm();
  return DepthPlane{-plane.normalized(), std::hypot(tilt_sigma_rad, kDepthPlane.camera_sigma_rad), plane};
}

void TagSizeCheck::add(const DepthPlane& plane, const Eigen::Isometry3d& T_camera_tag) {
  const Eigen::Vector3d centre = T_camera_tag.translation();
  const double inverse_depth = plane.inverse_depth.dot(centre / centre.z());
  if (!(inverse_depth > 0) || !(centre.z() > 0)) return;
  count_ = std::min(count_ + 1, kTagSize.max_frames);
  mean_ += (-std::log(inverse_depth * centre.z()) - mean_) / count_;
  distance_m_ += (centre.z() - distance_m_) / count_;
}

std::string TagSizeCheck::warning() const {
  const double ratio = std::exp(mean_);
  const double tolerance = kTagSize.tolerance + kTagSize.tolerance_per_m * std::max(0.0, distance_m_ - 1);
  if (count_ < kTagSize.min_frames || std::abs(mean_) < tolerance) return {};
  if (ratio > kTagSize.unit_factor || ratio < 1 / kTagSize.unit_factor)
    return capture::formatted(
        "depth: %.3g times the distance of tag %d by its size: depth.unit_m or tag.size_m is in another unit", ratio,
        id_);
  return capture::formatted("tag %d: by depth its square is %.0f mm wide, configured are %.0f mm", id_,
                            1e3 * size_m_ * ratio, 1e3 * size_m_);
}

}  // namespace lumigraft::reconstruct
