#include "relight/gather/clipped_pixels.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "relight/gather/parameters.h"

namespace lumigraft::relight {
namespace {

/// The mean logarithm of measured over other radiance in the channels that do not clip; NaN if all do.
float log_ratio(const CameraUpload& camera, std::size_t pixel, const Rgb& other,
                const capture::Image<float>& radiance) {
  float sum = 0, count = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const float log = std::log(radiance.data[3 * pixel + c] / other[static_cast<Eigen::Index>(c)]);
    if (camera.clipped(pixel, c) || !std::isfinite(log)) continue;
    sum += log;
    ++count;
  }
  return sum / count;
}

/// Sets values of weight 0 to what is known around them; far from that to 0.
void spread(const cv::Mat1f& weight, cv::Mat1f& logs) {
  cv::Mat1f around, weight_around;
  const cv::Size window(2 * kGather.clipped_reach_px + 1, 2 * kGather.clipped_reach_px + 1);
  cv::boxFilter(logs, around, -1, window);
  cv::boxFilter(weight, weight_around, -1, window);
  around /= weight_around + kGather.clipped_prior;
  around.copyTo(logs, weight == 0);
}

}  // namespace

bool restore_clipped(const reconstruct::Illumination& light, const std::vector<LightSampleSet>& lamps,
                     const CameraUpload& camera, std::vector<GBufferPixel>& seen, capture::Image<float>& radiance) {
  if (!camera.any_clipped()) return false;
  std::vector<Rgb> irradiance(seen.size());
  cv::Mat1f logs(radiance.height, radiance.width, 0.0f), weight = logs.clone();
  std::atomic<bool> any = false;
  const auto restores = [&](std::size_t i) { return camera.clipped(i) && seen[i].known && !seen[i].glossy; };
  for_each_index(seen.size(), kRows * radiance.width, [&](std::size_t i) {
    if (!restores(i)) return;
    any = true;
    const SurfaceHit& surface = seen[i].surface;
    irradiance[i] = unoccluded_irradiance(light, lamps, surface).max(std::numeric_limits<float>::min());
    const float log = log_ratio(camera, i, surface.bsdf.diffuse * irradiance[i] / kPi, radiance);
    if (!std::isfinite(log)) return;
    logs.ptr<float>()[i] = log;
    weight.ptr<float>()[i] = 1;
  });
  if (!any) return false;
  spread(weight, logs);
  for_each_index(seen.size(), kRows * radiance.width, [&](std::size_t i) {
    if (!restores(i)) return;
    GBufferPixel& pixel = seen[i];
    const Rgb white = irradiance[i] / kPi;
    const float ratio = std::exp(logs.ptr<float>()[i]), detail = std::exp(log_ratio(camera, i, pixel.before, radiance));
    const Rgb albedo = pixel.surface.bsdf.diffuse * (std::isfinite(detail) ? detail : ratio),
              expected = (pixel.surface.bsdf.diffuse * white * ratio).min(white);
    for (std::size_t c = 0; c < 3; ++c) {
      if (!camera.clipped(i, c)) continue;
      const auto k = static_cast<Eigen::Index>(c);
      float& bound = radiance.data[3 * i + c];
      const float more = bound > expected[k] ? bound / std::max(expected[k], 1e-3f * bound) : 1;
      pixel.albedo[k] = std::min(albedo[k] * more, 1.0f);
      bound = std::max(bound, expected[k]);
    }
  });
  return true;
}

}  // namespace lumigraft::relight
