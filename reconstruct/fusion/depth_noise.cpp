#include "reconstruct/fusion/depth_noise.h"

#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {

double oblique_noise(double incidence_rad) {
  if (incidence_rad <= M_PI / 18) return 0;
  const double rest = std::max(M_PI / 2 - incidence_rad, 1e-3);
  return incidence_rad * incidence_rad / (rest * rest);
}

double depth_sigma_m(double depth_m, double incidence_rad) {
  const double away = depth_m - 0.4;
  return kLeastSigmaM + 0.0019 * away * away + 0.0001 / std::sqrt(depth_m) * oblique_noise(incidence_rad);
}

float farthest_m(float sigma_m) {
  const float more = (sigma_m - static_cast<float>(kLeastSigmaM)) / 0.0019f;
  return more >= 0 ? 0.4f + std::sqrt(more) : 0;
}

}  // namespace lumigraft::reconstruct
