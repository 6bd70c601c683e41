#include "reconstruct/math/depth_noise.h"

#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {

double oblique_noise(double incidence_rad) {
  if (incidence_rad <= M_PI / 18) return 0;
  const double grazing_rad = std::max(M_PI / 2 - incidence_rad, 1e-3);
  return incidence_rad * incidence_rad / (grazing_rad * grazing_rad);
}

double depth_sigma_m(double depth_m, double incidence_rad) {
  const double offset = depth_m - 0.4;
  return kMinDepthSigma_m + 0.0019 * offset * offset + 0.0001 / std::sqrt(depth_m) * oblique_noise(incidence_rad);
}

float max_depth_m(float sigma_m) {
  const float excess_m = (sigma_m - static_cast<float>(kMinDepthSigma_m)) / 0.0019f;
  return excess_m >= 0 ? 0.4f + std::sqrt(excess_m) : 0;
}

}  // namespace lumigraft::reconstruct
