#include "relight/light_measures.h"

#include <cmath>
#include <numbers>

#include "reconstruct/light/environment.h"

namespace lumigraft::relight {

LightMeasures measure_light(const reconstruct::Illumination& light) {
  LightMeasures measures;
  const capture::Image<float>& rest = light.environment.radiance;
  double environment = 0;
  for (int v = 0; v < rest.height; ++v) {
    const double solid_angle = reconstruct::environment_solid_angle_sr(v, rest.width, rest.height) / 3;
    for (int u = 0; u < rest.width; ++u)
      for (int c = 0; c < 3; ++c) environment += solid_angle * rest.at(u, v, c);
  }
  double all = environment;
  for (const reconstruct::PointLight& lamp : light.lights) all += lamp.irradiance.mean();
  const double scale = all > 0 ? 1 / all : 0;
  measures.environment_fraction = static_cast<float>(scale * environment);

  // In the mean square over the sphere the bands add up, as their functions are orthonormal (Ramamoorthi & Hanrahan
  // 2001, eq. 7, 8).
  constexpr std::array kCosine = {std::numbers::pi_v<float>, 2 * std::numbers::pi_v<float> / 3,
                                  std::numbers::pi_v<float> / 4};
  std::array<float, 3> energy{};
  for (std::size_t i = 0; i < light.environment_sh.size(); ++i) {
    const std::size_t band = i == 0 ? 0 : i < 4 ? 1 : 2;
    energy[band] += (kCosine[band] * light.environment_sh[i]).squaredNorm();
  }
  // The mean of a source's irradiance over all normals is a quarter of its fluence at the point.
  const auto mean = static_cast<float>(all / 4);
  float higher = 0;
  for (std::size_t band = energy.size(); band-- > 1;) {
    higher += energy[band];
    measures.bands_left_out[band - 1] = mean > 0 ? std::sqrt(higher / (12 * std::numbers::pi_v<float>)) / mean : 0;
  }
  return measures;
}

}  // namespace lumigraft::relight
