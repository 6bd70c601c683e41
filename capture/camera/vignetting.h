#pragma once
// Vignetting: loss of light away from the optical axis.
//
// Transmission at the angle θ from the axis relative to that on the axis: t(θ) = exp(a θ² + b θ⁴ + c θ⁶), θ in radians.
// It includes the change of solid angle per pixel towards the rim of fish-eye projections.
#include <array>

#include "capture/camera/camera_model.h"
#include "capture/image.h"

namespace lumigraft::capture {

struct Vignetting {
  std::array<double, 3> terms{};  ///< a, b, c

  bool none() const { return terms == std::array<double, 3>{}; }
  double transmission(double angle_rad) const;
};

/// Largest angle from the optical axis in an image: of its corners or of the field of view.
double corner_angle_rad(const CameraModel& camera);

/// 1 / transmission per pixel, 1 channel; 1 outside the field of view. Empty if there is no vignetting.
Image<float> vignetting_gain(const Vignetting& vignetting, const CameraModel& camera);

}  // namespace lumigraft::capture
