#pragma once
// One depth picture as measurements of distance: what fusion asks of it.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "capture/camera_model.h"
#include "capture/image.h"

namespace lumigraft {

/// Rays of a camera's pixels, with z = 1, in the camera frame (x right, y down, z forward).
class DepthRays {
 public:
  explicit DepthRays(const CameraModel& model);
  const CameraModel& model() const { return model_; }
  /// Zero where the pixel sees nothing.
  const Eigen::Vector3f& at(int u, int v) const { return rays_[static_cast<std::size_t>(v) * model_.width + u]; }
  /// Pixel of a point in front of the camera, rounded; empty outside the picture.
  std::optional<Eigen::Vector2f> pixel(const Eigen::Vector3f& point_camera) const;
  /// Whether a sphere may lie in the picture; errs to true.
  bool sees(const Eigen::Vector3f& centre_camera, float radius_m) const;

 private:
  CameraModel model_;
  bool distorted_;
  std::vector<Eigen::Vector3f> rays_;
};

/// What a depth picture says about one point.
struct DepthSeen {
  float distance_m;  ///< to the surface, positive in front of it; along the normal where that is known
  float weight;      ///< 1 for a surface faced at 1 m
  float facing;      ///< cosine between the ray and the normal, in (0, 1]
  bool on_surface;   ///< the normal is known: no depth edge
  int u, v;          ///< the pixel
};

class DepthMeasurement {
 public:
  DepthMeasurement(const Image<float>& depth_m, const DepthRays& rays, float far_m, float truncation_m);
  std::optional<DepthSeen> along(const Eigen::Vector3f& point_camera) const;

 private:
  Eigen::Vector3f fit_normal(int u, int v, int radius, int step) const;

  const Image<float>& depth_m_;
  const DepthRays& rays_;
  float far_m_;
  float truncation_m_;
  std::vector<Eigen::Vector3f> normals_;  ///< camera frame, towards the camera; zero where unknown
};

}  // namespace lumigraft
