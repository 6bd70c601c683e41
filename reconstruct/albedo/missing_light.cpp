#include "reconstruct/albedo/missing_light.h"

#include <algorithm>
#include <numbers>
#include <optional>

#include "reconstruct/albedo/parameters.h"
#include "reconstruct/light/fluence.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const AlbedoParameters::MissingLight& kMissing = kAlbedoParameters.missing_light;

/// Albedo of a surface that reflects this radiance, mean of the channels.
float albedo_of(const Eigen::Vector3f& radiance, const Eigen::Array3f& irradiance) {
  return std::numbers::pi_v<float> * radiance.mean() / std::max(irradiance.mean(), 1e-9f);
}

}  // namespace

float reflected_over_possible(const Surface& surface, const std::vector<SampleLight>& light,
                              const IrradianceModel& room, const Illumination& illumination, double print_m) {
  if (const std::optional<SurfaceSample> paper = tag_paper(surface.points, print_m)) {
    Eigen::Array3f arriving = room.gather(paper->position, paper->normal, kMissing.paper_rays).irradiance.array();
    for (const PointLight& lamp : illumination.lights)
      arriving += lamp_irradiance(lamp, paper->position, paper->normal);
    return albedo_of(paper->radiance, arriving) / kMissing.max_paper_albedo;
  }
  std::vector<float> albedo;
  for (std::size_t i = 0; i < surface.samples.size(); ++i)
    if (surface.samples[i].usable)
      albedo.push_back(albedo_of(surface.samples[i].radiance, light[i].irradiance.array()));
  if (albedo.empty()) return 0;
  const auto median = albedo.begin() + static_cast<std::ptrdiff_t>(albedo.size() / 2);
  std::nth_element(albedo.begin(), median, albedo.end());
  return *median;
}

}  // namespace lumigraft::reconstruct
