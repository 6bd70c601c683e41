#include "capture/camera/vignetting.h"

#include <algorithm>
#include <cmath>

namespace lumigraft::capture {

double Vignetting::transmission(double angle_rad) const {
  const double s = angle_rad * angle_rad;
  return std::exp(s * (terms[0] + s * (terms[1] + s * terms[2])));
}

double corner_angle_rad(const CameraModel& camera) {
  if (camera.kind != CameraModel::Kind::pinhole) return 0.5 * camera.fov_rad;
  double widest_rad = 0;
  for (const double u : {-0.5, camera.width - 0.5})
    for (const double v : {-0.5, camera.height - 0.5})
      if (const auto d = camera.unproject({u, v}))
        widest_rad = std::max(widest_rad, std::atan2(d->head<2>().norm(), d->z()));
  return widest_rad;
}

Image<float> vignetting_gain(const Vignetting& vignetting, const CameraModel& camera) {
  if (vignetting.none()) return {};
  Image<float> gain(camera.width, camera.height, 1, 1.0f);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      if (const auto d = camera.unproject({u, v})) {
        gain.at(u, v) = static_cast<float>(1.0 / vignetting.transmission(std::atan2(d->head<2>().norm(), d->z())));
      }
    }
  }
  return gain;
}

}  // namespace lumigraft::capture
