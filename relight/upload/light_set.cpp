#include "relight/upload/light_set.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "relight/upload/lamp_emitter.h"
#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
shader::Lamp make_lamp(const LampEmitter& emitter) {
  shader::Lamp lamp;  // Eigen does not initialize
  lamp.position_radius << emitter.centre_m, emitter.radius_m;
  lamp.facing << emitter.normal, emitter.flat ? emitter.ahead : 0.0f;
  lamp.intensity << emitter.intensity, 0;
  return lamp;
}

/// Adds a lamp to the environment as a disc that preserves its irradiance.
void add_disc(capture::Image<float>& map, const reconstruct::PointLight& light) {
  const float texel_sr = 4 * kPi / static_cast<float>(map.width * map.height);
  const float radius = std::max(light.angular_radius_rad, std::sqrt(texel_sr / kPi) * 1.5f);
  float covered_sr = 0;
  for (int pass = 0; pass < 2; ++pass) {
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        const Eigen::Vector3f w = octahedral_direction({(x + 0.5f) / map.width, (y + 0.5f) / map.height});
        if (w.dot(light.direction) < std::cos(radius)) continue;
        if (pass == 0) covered_sr += texel_sr;
        for (int c = 0; pass == 1 && c < 3; ++c) map.at(x, y, c) += light.irradiance[c] / covered_sr;
      }
    }
  }
}

capture::Image<float> half(const capture::Image<float>& fine) {
  capture::Image<float> coarse(fine.width / 2, fine.height / 2, 4);
  for (int y = 0; y < coarse.height; ++y) {
    for (int x = 0; x < coarse.width; ++x) {
      for (int c = 0; c < 4; ++c) {
        coarse.at(x, y, c) = 0.25f * (fine.at(2 * x, 2 * y, c) + fine.at(2 * x + 1, 2 * y, c) +
                                      fine.at(2 * x, 2 * y + 1, c) + fine.at(2 * x + 1, 2 * y + 1, c));
      }
    }
  }
  return coarse;
}

}  // namespace

Eigen::Vector3f octahedral_direction(const Eigen::Vector2f& uv) {
  const float u = 2 * uv.x() - 1, v = 2 * uv.y() - 1;
  const float signed_distance = 1 - (std::abs(u) + std::abs(v)), r = 1 - std::abs(signed_distance);
  const float phi = (r == 0 ? 1.0f : (std::abs(v) - std::abs(u)) / r + 1) * kPi / 4;
  const float z = std::copysign(1 - r * r, signed_distance), s = r * std::sqrt(std::max(2 - r * r, 0.0f));
  return {std::copysign(std::cos(phi) * s, u), std::copysign(std::sin(phi) * s, v), z};
}

LightSet make_light_set(const reconstruct::Illumination& illumination, int max_lights) {
  LightSet set;
  const std::size_t drawn = std::min({illumination.lights.size(), static_cast<std::size_t>(std::max(max_lights, 0)),
                                      static_cast<std::size_t>(shader::kMaxLamps)});
  // Estimation from shading may have changed the lamps' order of strength since their detection.
  std::vector<reconstruct::PointLight> lamps = illumination.lights;
  std::stable_sort(lamps.begin(), lamps.end(), [](const reconstruct::PointLight& a, const reconstruct::PointLight& b) {
    return a.irradiance.sum() > b.irradiance.sum();
  });
  for (std::size_t i = 0; i < drawn; ++i) {
    set.lamp_ids.push_back(lamps[i].id);
    set.lamps.push_back(make_lamp(lamp_emitter(lamps[i], illumination.probe_position_m)));
  }

  // Four bilinear samples per texel.
  capture::Image<float> map(kUpload.environment_px, kUpload.environment_px, 4, 1.0f);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int i = 0; i < 4; ++i) {
        const Eigen::Vector2f uv((x + 0.25f + 0.5f * static_cast<float>(i & 1)) / map.width,
                                 (y + 0.25f + 0.5f * static_cast<float>(i >> 1)) / map.height);
        const Eigen::Vector3f w = octahedral_direction(uv);
        sum += illumination.environment.radiance.empty()
                   ? reconstruct::sh_radiance(illumination.environment_sh, w).cwiseMax(0.0f)
                   : illumination.environment.sample(w);
      }
      for (int c = 0; c < 3; ++c) map.at(x, y, c) = 0.25f * sum[c];
    }
  }
  for (std::size_t i = drawn; i < lamps.size(); ++i) add_disc(map, lamps[i]);

  set.environment.push_back(std::move(map));
  while (set.environment.size() < kUpload.environment_mips) set.environment.push_back(half(set.environment.back()));
  return set;
}

}  // namespace lumigraft::relight
