#include "reconstruct/light/occlusion_check.h"

#include <numbers>
#include <vector>

#include "reconstruct/light/parameters.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LightParameters::Occlusion& kOcclusion = kLightParameters.occlusion;

}  // namespace

std::optional<float> median_radiance(const capture::Frame* color, const capture::Response& response) {
  if (!color) return std::nullopt;
  const bool linear = !color->radiance.empty();
  const int width = linear ? color->radiance.width : color->encoded.width;
  const int height = linear ? color->radiance.height : color->encoded.height;
  std::vector<float> levels;
  for (int v = 0; v < height; v += kOcclusion.pixel_step) {
    for (int u = 0; u < width; u += kOcclusion.pixel_step) {
      float sum = 0;
      for (int c = 0; c < 3; ++c) {
        sum += linear ? color->radiance.at(u, v, c)
                      : static_cast<float>(response.to_linear(color->encoded.at(u, v, c), c) / color->exposure);
      }
      levels.push_back(sum / 3);
    }
  }
  return levels.empty() ? std::nullopt : std::optional(median(levels));
}

OcclusionCheck::Finding OcclusionCheck::check(double flux, std::optional<float> room_radiance, bool clipped) {
  Finding finding;
  // Without a colour image that shows the lamps still on, the room may really be dark.
  if (seen_ && flux < kOcclusion.max_flux_ratio * flux_ && room_radiance && room_radiance_ && *room_radiance_ > 0 &&
      *room_radiance > kOcclusion.min_colour_ratio * *room_radiance_) {
    finding.covered = true;
    finding.warning =
        "the fish-eye is covered: its image became dark and the colour image did not; the last light is kept";
    return finding;
  }
  seen_ = true;
  flux_ = flux;
  room_radiance_ = room_radiance;
  if (!clipped && room_radiance && std::numbers::pi * *room_radiance > kOcclusion.max_returned_ratio * flux) {
    finding.warning =
        "the fish-eye measures far less light than the room reflects to the colour camera: it is covered, "
        "or one of their exposures is wrong";
  }
  return finding;
}

}  // namespace lumigraft::reconstruct
