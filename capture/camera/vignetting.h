#pragma once
// How much less light a lens lets through away from its axis.
//
// Transmission at the angle θ from the axis, over that on it: t(θ) = exp(a θ² + b θ⁴ + c θ⁶), θ in radians. The falloff
// of a projection (Kannala & Brandt's lenses spread a direction's light over more pixels at the rim) is part of it.
#include <array>

#include "capture/camera/camera_model.h"
#include "capture/image.h"

namespace lumigraft::capture {

struct Vignetting {
  std::array<double, 3> terms{};  ///< a, b, c

  bool none() const { return terms == std::array<double, 3>{}; }
  double transmission(double angle_rad) const;
};

/// 1 / transmission by pixel, 1 channel; 1 where the lens sees nothing. Empty where there is no vignetting.
Image<float> vignetting_gain(const Vignetting& vignetting, const CameraModel& camera);

}  // namespace lumigraft::capture
