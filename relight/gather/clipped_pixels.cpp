#include "relight/gather/clipped_pixels.h"

#include <algorithm>
#include <atomic>
#include <limits>

namespace lumigraft::relight {

bool restore_clipped(const reconstruct::Illumination& light, const std::vector<LightSampleSet>& lamps,
                     const CameraUpload& camera, std::vector<GBufferPixel>& seen, capture::Image<float>& radiance) {
  std::atomic<bool> any = false;
  for_each_index(seen.size(), kRows * radiance.width, [&](std::size_t i) {
    GBufferPixel& pixel = seen[i];
    if (!pixel.known || pixel.glossy || !camera.clipped(i)) return;
    any = true;
    const Rgb irradiance = unoccluded_irradiance(light, lamps, pixel.surface).max(std::numeric_limits<float>::min());
    for (std::size_t c = 0; c < 3; ++c) {
      if (!camera.clipped(i, c)) continue;
      const auto k = static_cast<Eigen::Index>(c);
      float& bound = radiance.data[3 * i + c];
      pixel.albedo[k] = std::clamp(std::max(pixel.surface.bsdf.diffuse[k], kPi * bound / irradiance[k]), 0.0f, 1.0f);
      bound = std::max(bound, pixel.albedo[k] * irradiance[k] / kPi);
    }
  });
  return any;
}

}  // namespace lumigraft::relight
