#include "relight/look/camera_motion.h"

#include <cmath>

namespace lumigraft::relight {
namespace {

/// In the camera's frame, metres.
std::optional<Eigen::Vector3d> surface_at(const Viewpoint& view, const Eigen::Vector2i& pixel) {
  const std::optional<Eigen::Vector3d> ray = view.camera.unproject(pixel.cast<double>());
  if (!ray) return std::nullopt;
  const double depth_m = view.depth_m ? static_cast<double>(view.depth_m->at(pixel.x(), pixel.y())) : 0;
  if (depth_m > 0 && ray->z() > 0) return depth_m / ray->z() * *ray;
  const double distance_m = -view.T_tag_camera.translation().z() / (view.T_tag_camera.linear() * *ray).z();
  if (distance_m > 0 && std::isfinite(distance_m)) return distance_m * *ray;
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Vector2d> shift_px(const Viewpoint& now, const Eigen::Isometry3d& T_tag_camera_before,
                                        const Eigen::Vector2i& pixel) {
  const Eigen::Isometry3d T_before_now = T_tag_camera_before.inverse() * now.T_tag_camera;
  const std::optional<Eigen::Vector3d> surface = surface_at(now, pixel);
  if (!surface) return std::nullopt;
  const std::optional<Eigen::Vector2d> before = now.camera.project(T_before_now * *surface);
  if (!before) return std::nullopt;
  return *before - pixel.cast<double>();
}

}  // namespace lumigraft::relight
