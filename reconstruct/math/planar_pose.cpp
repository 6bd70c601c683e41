#include "reconstruct/math/planar_pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/math/rotation_vector.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Matrix3d nearest_rotation(const Matrix3d& m) {
  const Eigen::JacobiSVD<Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

/// Pose from the homography of the tag's plane (Zhang 2000, §3.1).
std::optional<Isometry3d> pose_of_homography(const SquareCorners& corners, double size_m) {
  const auto homography = square_homography(size_m, corners);
  if (!homography) return std::nullopt;
  const Homography& h = *homography;
  const Vector3d h1(h[0], h[3], h[6]), h2(h[1], h[4], h[7]), h3(h[2], h[5], 1);
  const double scale = 2 / (h1.norm() + h2.norm());
  if (!std::isfinite(scale)) return std::nullopt;
  Matrix3d r;
  r.col(0) = scale * h1;
  r.col(1) = scale * h2;
  r.col(2) = r.col(0).cross(r.col(1));
  return isometry(nearest_rotation(r), scale * h3);
}

/// Derivative of a corner's x/z, y/z by a rotation about the tag's centre and a translation, camera frame.
Eigen::Matrix<double, 2, 6> corner_by_pose(const Isometry3d& pose, const Vector3d& corner) {
  const Vector3d rotated = pose.linear() * corner;
  const Vector3d p = rotated + pose.translation();
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose << 0, rotated.z(), -rotated.y(), 1, 0, 0, -rotated.z(), 0, rotated.x(), 0, 1, 0, rotated.y(), -rotated.x(), 0,
      0, 0, 1;
  return by_point * by_pose;
}

/// Levenberg-Marquardt on the reprojection error; rotations are about the tag's centre, in the camera frame.
PlanarPose refine(Isometry3d pose, const SquareCorners& corners, double size_m) {
  const auto tag = tag_corners(size_m);
  double error = square_error(pose, corners, size_m);
  double damping = 1e-6;
  for (int iteration = 0; iteration < 50; ++iteration) {
    Eigen::Matrix<double, 6, 6> jtj = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> jtr = Eigen::Matrix<double, 6, 1>::Zero();
    for (int i = 0; i < 4; ++i) {
      const Vector3d p = pose * tag[i];
      const Eigen::Matrix<double, 2, 6> j = corner_by_pose(pose, tag[i]);
      const Vector2d r = p.head<2>() / p.z() - corners[i];
      jtj += j.transpose() * j;
      jtr += j.transpose() * r;
    }
    Eigen::Matrix<double, 6, 6> damped = jtj;
    damped.diagonal() *= 1 + damping;
    const Eigen::Matrix<double, 6, 1> step = solved(damped, -jtr);
    if (!step.allFinite()) break;
    const Isometry3d next = isometry(rotation_by(step.head<3>()) * pose.linear(), pose.translation() + step.tail<3>());
    const double next_error = square_error(next, corners, size_m);
    if (!(next_error < error)) {
      damping = std::max(damping, 1e-6) * 10;
      if (damping > 1e6) break;
      continue;
    }
    const bool converged = error - next_error < 1e-12;
    pose = next;
    error = next_error;
    damping /= 10;
    if (converged) break;
  }
  pose.linear() = nearest_rotation(pose.linear());
  return {pose, error};
}

}  // namespace

std::array<Vector3d, 4> tag_corners(double size_m) {
  const double h = size_m / 2;
  return {Vector3d(-h, -h, 0), Vector3d(h, -h, 0), Vector3d(h, h, 0), Vector3d(-h, h, 0)};
}

std::optional<Homography> square_homography(double size, const std::array<Vector2d, 4>& corners) {
  const auto square = tag_corners(size);
  Eigen::Matrix<double, 8, 8> a;
  Homography b;
  for (int i = 0; i < 4; ++i) {
    const double x = square[i].x(), y = square[i].y(), u = corners[i].x(), v = corners[i].y();
    a.row(2 * i) << x, y, 1, 0, 0, 0, -u * x, -u * y;
    a.row(2 * i + 1) << 0, 0, 0, x, y, 1, -v * x, -v * y;
    b[2 * i] = u;
    b[2 * i + 1] = v;
  }
  const Eigen::FullPivLU<Eigen::Matrix<double, 8, 8>> lu(a);
  return lu.isInvertible() ? std::optional<Homography>(lu.solve(b)) : std::nullopt;
}

PoseCovariance square_covariance(const Isometry3d& T_camera_tag, double size_m, double corner_sigma) {
  PoseCovariance information = PoseCovariance::Zero();
  for (const Vector3d& corner : tag_corners(size_m)) {
    const Eigen::Matrix<double, 2, 6> j = corner_by_pose(T_camera_tag, corner);
    information += j.transpose() * j / (corner_sigma * corner_sigma);
  }
  return camera_covariance(information_of(information), T_camera_tag);
}

PoseCovariance displaced_covariance(const Isometry3d& T_camera_tag, double size_m, const SquareCorners& displacement) {
  const auto tag = tag_corners(size_m);
  PoseCovariance covariance = PoseCovariance::Zero();
  for (const double sign : {-1.0, 1.0}) {
    SquareCorners seen;
    for (std::size_t i = 0; i < tag.size(); ++i) {
      const Vector3d p = T_camera_tag * tag[i];
      seen[i] = p.head<2>() / p.z() + sign * displacement[i];
    }
    const Isometry3d displaced = refine(T_camera_tag, seen, size_m).T_camera_tag;
    const Eigen::Matrix<double, 6, 1> step = step_between(T_camera_tag.inverse(), displaced.inverse());
    covariance += step * step.transpose() / 2;
  }
  return covariance;
}

Isometry3d mirrored(const Isometry3d& pose) {
  const Vector3d sight = pose.translation().normalized();
  Matrix3d r;
  for (int i = 0; i < 2; ++i) r.col(i) = pose.linear().col(i) - 2 * pose.linear().col(i).dot(sight) * sight;
  r.col(2) = r.col(0).cross(r.col(1));
  return isometry(nearest_rotation(r), pose.translation());
}

double square_error(const Isometry3d& T_camera_tag, const SquareCorners& corners, double size_m) {
  double sum = 0;
  const auto tag = tag_corners(size_m);
  for (int i = 0; i < 4; ++i) {
    const Vector3d p = T_camera_tag * tag[i];
    if (p.z() <= 0) return std::numeric_limits<double>::infinity();
    sum += (p.head<2>() / p.z() - corners[i]).squaredNorm();
  }
  return std::sqrt(sum / 4);
}

std::vector<PlanarPose> solve_square(const SquareCorners& corners, double size_m) {
  const auto first = pose_of_homography(corners, size_m);
  if (!first || !std::isfinite(square_error(*first, corners, size_m))) return {};
  std::vector<PlanarPose> poses = {refine(*first, corners, size_m)};
  const Isometry3d other = mirrored(poses[0].T_camera_tag);
  if (std::isfinite(square_error(other, corners, size_m))) {
    const PlanarPose second = refine(other, corners, size_m);
    const double angle = angle_between(second.T_camera_tag, poses[0].T_camera_tag);
    // A tag seen from behind is no valid minimum.
    const bool faces_camera = second.T_camera_tag.linear().col(2).dot(second.T_camera_tag.translation()) < 0;
    if (angle > 1e-3 && faces_camera) poses.push_back(second);
  }
  if (poses.size() == 2 && poses[1].error < poses[0].error) std::swap(poses[0], poses[1]);
  return poses;
}

}  // namespace lumigraft::reconstruct
