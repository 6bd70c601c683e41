#pragma once
// CameraModel's projection as a template function of its parameters, for automatic differentiation.
#include <Eigen/Core>
#include <array>
#include <cmath>

#include "capture/camera/camera_model.h"

namespace lumigraft::reconstruct {

constexpr int kLensNumbers = 9;

/// fx fy cx cy, then k1 k2 p1 p2 k3 of a pinhole, or k1 k2 k3 k4 of a fish-eye and a 0.
using LensNumbers = std::array<double, kLensNumbers>;

inline LensNumbers lens_numbers(const capture::CameraModel& camera) {
  LensNumbers lens{camera.fx, camera.fy, camera.cx, camera.cy};
  const bool pinhole = camera.kind == capture::CameraModel::Kind::pinhole;
  for (std::size_t i = 0; i < (pinhole ? 5u : 4u); ++i) lens[4 + i] = pinhole ? camera.distortion[i] : camera.k[i];
  return lens;
}

/// A fish-eye of any kind becomes a Kannala-Brandt model.
inline capture::CameraModel with_lens(capture::CameraModel camera, const LensNumbers& lens) {
  camera.fx = lens[0];
  camera.fy = lens[1];
  camera.cx = lens[2];
  camera.cy = lens[3];
  if (camera.kind == capture::CameraModel::Kind::pinhole) {
    for (std::size_t i = 0; i < 5; ++i) camera.distortion[i] = lens[4 + i];
  } else {
    camera.kind = capture::CameraModel::Kind::kannala_brandt;
    for (std::size_t i = 0; i < 4; ++i) camera.k[i] = lens[4 + i];
  }
  return camera;
}

/// As CameraModel::project, without the limit of the field of view. False where the point is behind a pinhole.
template <typename T>
bool project_through(bool pinhole, const T* lens, const Eigen::Matrix<T, 3, 1>& p, Eigen::Matrix<T, 2, 1>& pixel) {
  using std::atan2;
  using std::sqrt;
  T x, y;
  if (pinhole) {
    if (p.z() <= T(1e-9)) return false;
    const T a = p.x() / p.z(), b = p.y() / p.z(), s = a * a + b * b;
    const T radial = T(1) + s * (lens[4] + s * (lens[5] + s * lens[8]));
    x = a * radial + T(2) * lens[6] * a * b + lens[7] * (s + T(2) * a * a);
    y = b * radial + lens[6] * (s + T(2) * b * b) + T(2) * lens[7] * a * b;
  } else {
    const T square = p.x() * p.x() + p.y() * p.y();
    if (square < T(1e-24)) {  // r / sin θ → 1; the derivative of the square root is infinite there
      x = p.x() / p.z();
      y = p.y() / p.z();
    } else {
      const T off_axis = sqrt(square), theta = atan2(off_axis, p.z()), s = theta * theta;
      const T radius = theta * (T(1) + s * (lens[4] + s * (lens[5] + s * (lens[6] + s * lens[7]))));
      x = radius * p.x() / off_axis;
      y = radius * p.y() / off_axis;
    }
  }
  pixel = {lens[0] * x + lens[2], lens[1] * y + lens[3]};
  return true;
}

}  // namespace lumigraft::reconstruct
