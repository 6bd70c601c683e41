#include "reconstruct/shading/noise_floor.h"

#include <algorithm>

#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {

float noise_floor_radiance(const std::vector<SurfaceSample>& samples) {
  constexpr float kRatio = kShadingParameters.noise_floor_ratio, kMin = kShadingParameters.min_noise_floor;
  double sum = 0;
  for (const SurfaceSample& sample : samples) sum += sample.radiance.mean();
  return samples.empty() ? kMin : std::max(kMin, kRatio * static_cast<float>(sum / samples.size()));
}

}  // namespace lumigraft::reconstruct
