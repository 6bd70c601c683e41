#pragma once
// Synthetic fish-eye images for tests of light.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "capture/image.h"
#include "capture/session/session.h"
#include "reconstruct/light/parameters.h"

namespace lumigraft::reconstruct {

inline capture::FisheyeCamera fisheye(double fov_degrees = 190, int size = 300) {
  capture::FisheyeCamera camera;
  camera.model.kind = capture::CameraModel::Kind::equidistant;
  camera.model.width = camera.model.height = size;
  camera.model.fx = camera.model.fy = size / 2.0 / (fov_degrees / 2 * kDegree);
  camera.model.cx = camera.model.cy = size / 2.0 - 0.5;
  camera.model.fov_rad = fov_degrees * kDegree;
  camera.T_tag_fisheye.linear() = Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return camera;
}

using Radiance = std::function<Eigen::Vector3f(const Eigen::Vector3f&)>;

/// Mask of clipped pixels of a picture without any.
inline capture::Image<std::uint8_t> unclipped(const capture::Image<float>& picture) {
  return capture::Image<std::uint8_t>(picture.width, picture.height, 1, 0);
}

/// Renders with 3 x 3 samples per pixel, so that edges are blurred as by a real pixel.
inline capture::Image<float> render(const capture::FisheyeCamera& camera, const Radiance& radiance) {
  capture::Image<float> picture(camera.model.width, camera.model.height, 3);
  const Eigen::Matrix3d R = camera.T_tag_fisheye.linear();
  for (int v = 0; v < picture.height; ++v) {
    for (int u = 0; u < picture.width; ++u) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int i = 0; i < 9; ++i) {
        const auto d = camera.model.unproject(Eigen::Vector2d(u + (i % 3 - 1) / 3.0, v + (i / 3 - 1) / 3.0));
        if (d) sum += radiance((R * *d).cast<float>());
      }
      for (int c = 0; c < 3; ++c) picture.at(u, v, c) = sum[c] / 9;
    }
  }
  return picture;
}

inline Eigen::Vector3f towards(double polar_degrees, double azimuth_degrees) {
  const double t = polar_degrees * kDegree, p = azimuth_degrees * kDegree;
  return Eigen::Vector3d(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)).cast<float>();
}

inline bool within(const Eigen::Vector3f& d, const Eigen::Vector3f& axis, double degrees) {
  return d.dot(axis) >= std::cos(degrees * kDegree);
}

inline double angle_degrees(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::acos(std::min(1.0, a.cast<double>().normalized().dot(b.cast<double>().normalized()))) / kDegree;
}

inline double disk_sr(double radius_degrees) { return 2 * std::numbers::pi * (1 - std::cos(radius_degrees * kDegree)); }

}  // namespace lumigraft::reconstruct
