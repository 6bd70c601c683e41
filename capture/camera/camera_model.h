#pragma once
// Camera models: mapping between directions and pixels.
//
// Frame of reference: the camera frame of OpenCV (x right, y down, z forward along the optical axis).
// Pixels: the centre of pixel (u, v) is at integer u, v.
//
//   pinhole          OpenCV's model with k1 k2 p1 p2 k3 (Brown 1966, "Decentering Distortion of Lenses")
//   equidistant      r = f θ
//   kannala_brandt   r = f (θ + k1 θ³ + k2 θ⁵ + k3 θ⁷ + k4 θ⁹)  (Kannala & Brandt 2006, eq. 6, odd terms)
#include <Eigen/Core>
#include <array>
#include <optional>

namespace lumigraft::capture {

struct CameraModel {
  enum class Kind { pinhole, equidistant, kannala_brandt };

  Kind kind = Kind::pinhole;
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels; equidistant uses fx = fy = f
  std::array<double, 5> distortion{};     ///< pinhole: k1 k2 p1 p2 k3
  std::array<double, 4> k{};              ///< kannala_brandt: k1..k4
  double fov_rad = 0;                     ///< fish-eye: full field of view; directions beyond it have no pixel

  /// Pixel of a direction of any length. Empty if the camera cannot see it: behind a pinhole, beyond the field of view,
  /// or where the distortion polynomial is not monotonic any more (folded). The pixel may lie outside the image.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& direction_camera) const;

  /// Unit direction of a pixel. Empty if no direction maps to it. Inverse of project to 1e-9.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const;

  bool inside(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width - 0.5 && pixel.y() < height - 0.5;
  }

  /// Solid angle of pixel (u, v) in steradians; 0 outside the field of view.
  double solid_angle_sr(int u, int v) const;
};

}  // namespace lumigraft::capture
