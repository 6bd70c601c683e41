#include "reconstruct/pose/surface_anchor.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "reconstruct/math/rotation_vector.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

struct Plane {
  Vector3f normal = Vector3f::UnitZ();  ///< camera frame, towards the camera
  float distance_m = 0;                 ///< normal · point = -distance
  float area_m2 = 0;

  bool contains(const DepthGrid::Point& point) const {
    return point.normal.dot(normal) > kSurfaceAnchor.min_normal_cosine &&
           std::abs(normal.dot(point.position) + distance_m) < kSurfaceAnchor.gate_sigmas * point.sigma_m;
  }
};

/// Of the patch that a point of the grid stands for, up to a factor that is the same for all.
float area_of(const DepthGrid::Point& point) {
  const float slant = -point.normal.dot(point.position.normalized());
  return point.position.z() * point.position.z() / std::max(slant, kSurfaceAnchor.min_slant);
}

float area_on(const Plane& plane, const std::vector<DepthGrid::Point>& points) {
  float area = 0;
  for (const DepthGrid::Point& point : points)
    if (plane.contains(point)) area += area_of(point);
  return area;
}

/// Least squares over the points on the plane; the variance of its normal comes with it.
struct PlaneFit {
  Plane plane;
  Eigen::Matrix3d covariance;  ///< of (rotation about two axes of the plane, distance), in the order x, y, distance
};

PlaneFit fitted(const Plane& start, const std::vector<DepthGrid::Point>& points) {
  const Vector3f x = start.normal.unitOrthogonal(), y = start.normal.cross(x);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const DepthGrid::Point& point : points) {
    if (!start.contains(point)) continue;
    const float sigma_m = point.sigma_m * std::sqrt(static_cast<float>(kIcp.correlation));
    const Eigen::Vector3d row =
        Vector3f(x.dot(point.position), y.dot(point.position), 1).cast<double>() / static_cast<double>(sigma_m);
    information += row * row.transpose();
    right -= row * static_cast<double>((start.normal.dot(point.position) + start.distance_m) / sigma_m);
  }
  const Eigen::Matrix3d covariance = information.inverse();
  const Vector3f step = (covariance * right).cast<float>();
  PlaneFit fit{start, covariance};
  const Vector3f normal = start.normal + step.x() * x + step.y() * y;
  fit.plane.normal = normal.normalized();
  fit.plane.distance_m = (start.distance_m + step.z()) / normal.norm();
  return fit;
}

/// The largest plane, of those that are level or of all.
Plane largest(const std::vector<DepthGrid::Point>& points, bool level) {
  Plane best;
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kSurfaceAnchor.trials);
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const DepthGrid::Point& seed = points[i];
    if (level && -seed.normal.y() < kSurfaceAnchor.min_upwards) continue;
    Plane plane{seed.normal, -seed.normal.dot(seed.position), 0};
    plane = fitted(plane, points).plane;  // a single normal is noisy
    plane.area_m2 = area_on(plane, points);
    if (plane.area_m2 > best.area_m2) best = plane;
  }
  return best;
}

}  // namespace

std::optional<PoseEstimate> anchored_on_surface(const DepthGrid& grid) {
  std::vector<DepthGrid::Point> points;
  float seen = 0;
  for (const DepthGrid::Point& point : grid.points) {
    if (point.normal.isZero()) continue;
    points.push_back(point);
    seen += area_of(point);
  }
  if (points.size() < static_cast<std::size_t>(kIcp.min_points)) return std::nullopt;
  Plane plane = largest(points, true);
  if (plane.area_m2 < kSurfaceAnchor.min_share * seen) plane = largest(points, false);
  if (plane.area_m2 < kSurfaceAnchor.min_share * seen) return std::nullopt;
  const PlaneFit fit = fitted(fitted(plane, points).plane, points);
  if (!fit.covariance.allFinite()) return std::nullopt;

  const Vector3f& normal = fit.plane.normal;
  const DepthGrid::Point* middle = nullptr;
  const auto off_axis = [](const DepthGrid::Point& p) { return p.position.head<2>().norm() / p.position.z(); };
  for (const DepthGrid::Point& point : points)
    if (fit.plane.contains(point) && (!middle || off_axis(point) < off_axis(*middle))) middle = &point;
  if (!middle) return std::nullopt;
  const Vector3f origin = middle->position - (normal.dot(middle->position) + fit.plane.distance_m) * normal;
  // The camera's right, or its top where the normal points to the right.
  Vector3f x = Vector3f::UnitX() - normal.x() * normal;
  if (x.norm() < kSurfaceAnchor.min_slant) x = -Vector3f::UnitY() + normal.y() * normal;
  x.normalize();
  Eigen::Matrix3d to_camera;
  to_camera << x.cast<double>(), normal.cross(x).cast<double>(), normal.cast<double>();
  PoseEstimate result;
  result.T_tag_camera =
      isometry(Eigen::Quaterniond(to_camera).normalized().toRotationMatrix(), origin.cast<double>()).inverse();
  // The frame is where the camera saw it, so its place is exact; only the normal has noise.
  const double tilt_variance = fit.covariance.topLeftCorner<2, 2>().trace();
  result.covariance.diagonal().tail<3>().setConstant(tilt_variance);
  result.covariance.diagonal().head<3>().setConstant(fit.covariance(2, 2));
  return result;
}

}  // namespace lumigraft::reconstruct
