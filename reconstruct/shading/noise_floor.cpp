#include "reconstruct/shading/noise_floor.h"

#include <algorithm>

namespace lumigraft::reconstruct {

float dark_radiance(const std::vector<SurfaceSample>& samples) {
  constexpr float kShare = 0.02f, kLeast = 1e-6f;
  double sum = 0;
  for (const SurfaceSample& sample : samples) sum += sample.radiance.mean();
  return samples.empty() ? kLeast : std::max(kLeast, kShare * static_cast<float>(sum / samples.size()));
}

}  // namespace lumigraft::reconstruct
