#include "reconstruct/measures.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "reconstruct/light_environment.h"
#include "reconstruct/median.h"

namespace lumigraft {
namespace {

using Eigen::Vector3f;

constexpr float kBeside_m = 0.06f;  // how far apart points are whose normals are compared, at most
constexpr float kOnPlane_m = 0.015f, kAlike = 0.95f;
constexpr std::size_t kSeeds = 40;  // points tried as the largest plane's

}  // namespace

LightMeasures measure_light(const Illumination& light) {
  LightMeasures measures;
  const Image<float>& rest = light.remainder.radiance;
  double remainder = 0, all = 0;
  for (int v = 0; v < rest.height; ++v) {
    const double solid_angle = environment_solid_angle_sr(v, rest.width, rest.height) / 3;
    for (int u = 0; u < rest.width; ++u)
      for (int c = 0; c < 3; ++c) remainder += solid_angle * rest.at(u, v, c);
  }
  all = remainder;
  for (const PointLight& lamp : light.lights) all += lamp.irradiance.mean();
  const double scale = all > 0 ? 1 / all : 0;
  for (const PointLight& lamp : light.lights)
    measures.lamp_share.push_back(static_cast<float>(scale * lamp.irradiance.mean()));
  measures.remainder_share = static_cast<float>(scale * remainder);

  // Squared over the sphere the bands add up: their functions are orthonormal (Ramamoorthi & Hanrahan 2001, eq. 7, 8).
  constexpr std::array kCosine = {std::numbers::pi_v<float>, 2 * std::numbers::pi_v<float> / 3,
                                  std::numbers::pi_v<float> / 4};
  float sum = 0;
  for (std::size_t i = 0; i < light.remainder_sh.size(); ++i) {
    const std::size_t band = i == 0 ? 0 : i < 4 ? 1 : 2;
    const float energy = (kCosine[band] * light.remainder_sh[i]).squaredNorm();
    measures.band_share[band] += energy;
    sum += energy;
  }
  // The mean over all normals of a source's irradiance is a quarter of what it sends to a sphere's middle.
  const auto mean = static_cast<float>(all / 4);
  float higher = 0;
  for (std::size_t band = measures.band_share.size(); band-- > 1;) {
    higher += measures.band_share[band];
    measures.bands_left_out[band - 1] = mean > 0 ? std::sqrt(higher / (12 * std::numbers::pi_v<float>)) / mean : 0;
  }
  for (float& share : measures.band_share) share = sum > 0 ? share / sum : 0;
  return measures;
}

SurfaceMeasures measure_surface(const std::vector<RoomPoint>& points, const Vector3f& place_m, float radius_m) {
  std::vector<RoomPoint> near;
  for (const RoomPoint& p : points)
    if ((p.position_m - place_m).squaredNorm() < radius_m * radius_m) near.push_back(p);
  SurfaceMeasures measures;
  measures.points = static_cast<int>(near.size());
  if (near.empty()) return measures;

  std::vector<float> turns;
  for (std::size_t i = 0; i < near.size(); ++i) {
    for (std::size_t j = i + 1; j < near.size(); ++j) {
      const float way_m = (near[i].position_m - near[j].position_m).norm();
      if (way_m > kBeside_m || way_m < 0.25f * kBeside_m) continue;
      const float turn = std::acos(std::clamp(near[i].normal.dot(near[j].normal), -1.0f, 1.0f));
      turns.push_back(turn / way_m);
    }
  }
  measures.curvature_per_m = median(turns);

  std::size_t most = 0;
  for (std::size_t seed = 0; seed < near.size(); seed += std::max<std::size_t>(near.size() / kSeeds, 1)) {
    const RoomPoint& s = near[seed];
    const auto on = std::count_if(near.begin(), near.end(), [&](const RoomPoint& p) {
      return p.normal.dot(s.normal) > kAlike && std::abs(s.normal.dot(p.position_m - s.position_m)) < kOnPlane_m;
    });
    most = std::max(most, static_cast<std::size_t>(on));
  }
  measures.clutter = 1 - static_cast<float>(most) / static_cast<float>(near.size());
  return measures;
}

float changed_share(const DistanceField& now, const DistanceField& before) {
  if (now.bricks.empty()) return 0;
  const auto changed = std::count_if(now.bricks.begin(), now.bricks.end(), [&](const auto& entry) {
    return before.brick(entry.first) != entry.second.get();
  });
  return static_cast<float>(changed) / static_cast<float>(now.bricks.size());
}

float moved_share(const DistanceField& now, const DistanceField& before) {
  if (now.bricks.empty()) return 0;
  const auto mean = [](const FieldBrick& brick) {
    Vector3f sum = Vector3f::Zero();
    float weights = 0;
    for (std::size_t i = 0; i < brick.radiance.size(); ++i) {
      sum += brick.radiance_weight[i] * brick.radiance[i];
      weights += brick.radiance_weight[i];
    }
    return weights > 0 ? (sum / weights).eval() : Vector3f::Zero().eval();
  };
  const auto moved = std::count_if(now.bricks.begin(), now.bricks.end(), [&](const auto& entry) {
    const FieldBrick* was = before.brick(entry.first);
    if (was == entry.second.get()) return false;
    if (!was) return true;
    const Vector3f then = mean(*was), here = mean(*entry.second);
    return (here - then).norm() > kOtherRadiance * std::max(here.norm(), then.norm());
  });
  return static_cast<float>(moved) / static_cast<float>(now.bricks.size());
}

AlbedoNews compare_albedo(const AlbedoField& now, const AlbedoField& before) {
  double change = 0, sum = 0, sigma = 0, sigma_before = 0;
  std::size_t known = 0, fresh = 0;
  for (const auto& [key, brick] : now.bricks) {
    const auto was = before.bricks.find(key);
    for (std::size_t i = 0; i < brick->sigma.size(); ++i) {
      if (brick->sigma[i] < 0) continue;
      ++known;
      if (was == before.bricks.end() || was->second->sigma[i] < 0) {
        ++fresh;
        continue;
      }
      change += (brick->albedo[i] - was->second->albedo[i]).cwiseAbs().sum();
      sum += was->second->albedo[i].sum();
      sigma += brick->sigma[i];
      sigma_before += was->second->sigma[i];
    }
  }
  AlbedoNews news;
  news.change = sum > 0 ? static_cast<float>(change / sum) : 1;
  news.newly_known = known > 0 ? static_cast<float>(fresh) / static_cast<float>(known) : 0;
  news.surer = sigma_before > 0 ? static_cast<float>(1 - sigma / sigma_before) : 0;
  return news;
}

SceneMeasures measure_scene(const Illumination& light, std::vector<RoomPoint> surface, const GlossField* gloss) {
  SceneMeasures measures;
  measures.light = measure_light(light);
  measures.surface = std::move(surface);
  if (gloss) {
    measures.glossy_share = gloss->glossy_share();
    measures.gloss_known_share = gloss->known_share();
  }
  return measures;
}

}  // namespace lumigraft
