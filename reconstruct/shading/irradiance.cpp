#include "reconstruct/shading/irradiance.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "reconstruct/light/environment.h"
#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kGolden = 2.39996323f;  ///< golden angle: Vogel's spiral on the lamp's disk
constexpr const ShadingParameters::Surroundings& kFar = kShadingParameters.surroundings;
constexpr const ShadingParameters::UnobservedSpace& kUnobserved = kShadingParameters.unobserved;

/// Van der Corput's radical inverse in base 2.
float radical_inverse(std::uint32_t i) {
  i = (i << 16) | (i >> 16);
  i = ((i & 0x00ff00ffu) << 8) | ((i & 0xff00ff00u) >> 8);
  i = ((i & 0x0f0f0f0fu) << 4) | ((i & 0xf0f0f0f0u) >> 4);
  i = ((i & 0x33333333u) << 2) | ((i & 0xccccccccu) >> 2);
  i = ((i & 0x55555555u) << 1) | ((i & 0xaaaaaaaau) >> 1);
  return static_cast<float>(i) * 0x1p-32f;
}

struct Frame {
  Eigen::Vector3f x, y, z;
};

Frame frame_around(const Eigen::Vector3f& z) {
  int axis = 0;
  z.cwiseAbs().minCoeff(&axis);
  const Eigen::Vector3f e = Eigen::Vector3f::Unit(axis);
  const Eigen::Vector3f x = (e - e.dot(z) * z).normalized();
  return {x, {z.y() * x.z() - z.z() * x.y(), z.z() * x.x() - z.x() * x.z(), z.x() * x.y() - z.y() * x.x()}, z};
}

/// The environment with cells that show something near filled from the nearest cells that do not: seen from another
/// point the near surface is in another direction, where rays hit it in the field.
EnvironmentMap without_near(const EnvironmentMap& picture, const FieldRays& rays, const Eigen::Vector3f& probe,
                            const Enclosure* room) {
  const capture::Image<float>& from = picture.radiance;
  EnvironmentMap result = picture;
  std::vector<std::size_t> far, near;
  std::vector<Eigen::Vector3f> directions;
  for (int v = 0; v < from.height; ++v) {
    for (int u = 0; u < from.width; ++u) {
      directions.push_back(environment_direction(u, v, from.width, from.height));
      const auto hit = rays.first_crossing(probe, directions.back(), kShadingParameters.max_gather_m);
      const auto exit = hit && room ? room->leave(probe, directions.back()) : std::nullopt;
      const bool is_near =
          hit && !(exit && (*hit - probe).norm() > kShadingParameters.on_side_ratio * exit->distance_m);
      (is_near ? near : far).push_back(directions.size() - 1);
    }
  }
  if (far.empty()) return result;
  for (const std::size_t cell : near) {
    // Weights ~ 1/angle⁶: the nearest cells dominate.
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float weights = 0;
    for (std::size_t i = cell % kFar.near_fill_stride; i < far.size(); i += kFar.near_fill_stride) {
      const std::size_t other = far[i];
      const float squared = 2 - 2 * directions[cell].dot(directions[other]) + 1e-3f;
      const float w = 1 / (squared * squared * squared);
      sum += w * Eigen::Map<const Eigen::Vector3f>(&from.data[3 * other]);
      weights += w;
    }
    if (!(weights > 0)) continue;
    for (int c = 0; c < 3; ++c) result.radiance.data[3 * cell + c] = sum[c] / weights;
  }
  return result;
}

int cell_of(const Eigen::Vector3f& direction, int width, int height) {
  const float phi = std::atan2(direction.y(), direction.x()), theta = std::acos(std::clamp(direction.z(), -1.0f, 1.0f));
  const int u = static_cast<int>((phi / kPi + 1) * 0.5f * static_cast<float>(width)),
            v = static_cast<int>(theta / kPi * static_cast<float>(height));
  return std::clamp(v, 0, height - 1) * width + std::clamp(u, 0, width - 1);
}

}  // namespace

IrradianceModel::IrradianceModel(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                 const Illumination& illumination, const Enclosure* room)
    : IrradianceModel(field, rays, metal, room,
                      {illumination.probe_position_m,
                       without_near(illumination.environment, rays, illumination.probe_position_m, room)}) {
  surroundings_.use_guessed =
      room && std::count_if(room->sides.begin(), room->sides.end(),
                            [](const Enclosure::Side& side) { return side.measured; }) >= kFar.min_measured_sides;
  const EnvironmentMap& environment = illumination.environment;
  if (std::all_of(environment.seen.data.begin(), environment.seen.data.end(),
                  [](std::uint8_t seen) { return seen != 0; }))
    return;
  const int width = environment.seen.width, height = environment.seen.height;
  const auto for_each_seen = [&](const auto& add) {  // cell, direction and solid angle
    for (int i = 0; i < width * height; ++i) {
      const int u = i % width, v = i / width;
      if (environment.seen.at(u, v))
        add(i, environment_direction(u, v, width, height), environment_solid_angle_sr(v, width, height));
    }
  };
  for_each_seen([&](int, const Eigen::Vector3f& direction, float sr) { surroundings_.up += sr * direction; });
  surroundings_.up.normalize();
  for_each_seen([&](int cell, const Eigen::Vector3f& direction, float sr) {
    const float cosine = std::max(0.0f, surroundings_.up.dot(direction));
    surroundings_.floor_irradiance +=
        cosine * sr * Eigen::Map<const Eigen::Vector3f>(&environment.radiance.data[3 * static_cast<std::size_t>(cell)]);
  });
  std::vector<float> heights;
  for (const RoomPoint& point : room_points(field)) heights.push_back(surroundings_.up.dot(point.position_m));
  surroundings_.floor_m = surroundings_.up.dot(surroundings_.probe);
  if (heights.empty()) return;
  const auto low =
      heights.begin() + static_cast<std::ptrdiff_t>(kFar.below_floor_fraction * static_cast<float>(heights.size()));
  std::nth_element(heights.begin(), low, heights.end());
  surroundings_.floor_m = std::min(surroundings_.floor_m, *low);
}

IrradianceModel::IrradianceModel(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                 const Enclosure* room, Surroundings surroundings)
    : field_(field),
      rays_(rays),
      metal_(metal),
      enclosure_(room),
      lift_m_(kShadingParameters.lift_voxels * field.voxel_m),
      surroundings_(std::move(surroundings)) {}

Eigen::Vector3f IrradianceModel::far_radiance(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction) const {
  const auto exit = enclosure_ ? enclosure_->leave(from_m, direction) : std::nullopt;
  const bool measured = exit && enclosure_->sides[exit->side].measured;
  if (!measured && !(exit && surroundings_.use_guessed)) return surroundings_.far.sample(direction);
  const Eigen::Vector3f there =
      surroundings_.far.sample((from_m + exit->distance_m * direction - surroundings_.probe).stableNormalized());
  return measured ? there : (0.5f * (there + surroundings_.far.sample(direction))).eval();
}

std::optional<Eigen::Vector3f> IrradianceModel::floor_hit(const Eigen::Vector3f& from_m,
                                                          const Eigen::Vector3f& direction) const {
  const float descent = -surroundings_.up.dot(direction),
              above_m = surroundings_.up.dot(from_m) - surroundings_.floor_m;
  if (descent < 1e-3f || above_m < 0) return std::nullopt;
  if (surroundings_.far.seen.data[static_cast<std::size_t>(
          cell_of(direction, surroundings_.far.seen.width, surroundings_.far.seen.height))])
    return std::nullopt;
  return from_m + above_m / descent * direction;
}

std::vector<Eigen::Vector3f> IrradianceModel::lamp_irradiance_on_floor(const std::vector<PointLight>& lamps) const {
  std::vector<Eigen::Vector3f> cells(kFar.floor_cells * kFar.floor_cells, Eigen::Vector3f::Zero());
  if (surroundings_.up.isZero()) return cells;
  const Frame frame = frame_around(surroundings_.up);
  const Eigen::Vector3f middle =
      surroundings_.probe +
      (surroundings_.floor_m + kFar.above_floor_m - surroundings_.up.dot(surroundings_.probe)) * surroundings_.up;
  for (int i = 0; i < kFar.floor_cells * kFar.floor_cells; ++i) {
    const auto across = [&](int k) {
      return (static_cast<float>(k) + 0.5f - 0.5f * kFar.floor_cells) * kFar.floor_cell_m;
    };
    const Eigen::Vector3f point =
        middle + across(i % kFar.floor_cells) * frame.x + across(i / kFar.floor_cells) * frame.y;
    for (const PointLight& lamp : lamps) {
      const Eigen::Vector3f at = lamp.distance_known
                                     ? lamp.position_m
                                     : surroundings_.probe + static_cast<float>(kFar.lamp_distance_m) * lamp.direction;
      const Eigen::Vector3f offset = point - at, towards = offset.normalized();
      const float arriving = std::max(0.0f, -surroundings_.up.dot(towards)) * lamp.emission(towards);
      if (arriving <= 0 ||
          !rays_.free(point, at + (kShadingParameters.lamp_radii_clear * lamp.radius_m + lift_m_) * towards))
        continue;
      cells[static_cast<std::size_t>(i)] +=
          arriving * (at - surroundings_.probe).squaredNorm() / offset.squaredNorm() * lamp.irradiance;
    }
  }
  return cells;
}

Eigen::Vector3f IrradianceModel::irradiance_from_floor(const Gathered& gathered,
                                                       const std::vector<Eigen::Vector3f>& floor_grid) const {
  if (gathered.floor_hits.empty()) return Eigen::Vector3f::Zero();
  const Frame frame = frame_around(surroundings_.up);
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const Eigen::Vector3f& hit : gathered.floor_hits) {
    const Eigen::Vector3f offset = (hit - surroundings_.probe) / kFar.floor_cell_m;
    const auto x = static_cast<int>(std::floor(offset.dot(frame.x) + 0.5f * kFar.floor_cells)),
               y = static_cast<int>(std::floor(offset.dot(frame.y) + 0.5f * kFar.floor_cells));
    if (x < 0 || y < 0 || x >= kFar.floor_cells || y >= kFar.floor_cells) continue;
    sum += floor_grid[static_cast<std::size_t>(x + kFar.floor_cells * y)];
  }
  return gathered.floor_weight * sum;
}

IrradianceModel::Gathered IrradianceModel::gather(const Eigen::Vector3f& position_m, const Eigen::Vector3f& normal,
                                                  int directions) const {
  const Frame frame = frame_around(normal);
  const Eigen::Vector3f from = position_m + lift_m_ * normal;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float from_surface = 0;
  int metal_hits = 0;
  std::vector<Eigen::Vector3f> floor_hits;
  for (int i = 0; i < directions; ++i) {
    const float s = (i + 0.5f) / directions, phi = 2 * kPi * radical_inverse(static_cast<std::uint32_t>(i));
    const float r = std::sqrt(s);
    const Eigen::Vector3f direction =
        (r * std::cos(phi) * frame.x + r * std::sin(phi) * frame.y + std::sqrt(1 - s) * frame.z).normalized();
    const auto hit = rays_.first_crossing(from, direction, kShadingParameters.max_gather_m);
    const auto radiance = hit ? field_.radiance(*hit) : std::nullopt;
    metal_hits += hit && metal_.contains(*hit);
    if (radiance) {
      sum += *radiance;
      from_surface += radiance->mean();
    } else if (const auto floor = hit ? std::nullopt : floor_hit(from, direction)) {
      sum += kTypicalAlbedo / kPi * surroundings_.floor_irradiance;
      floor_hits.push_back(*floor);
    } else {
      sum += far_radiance(from, direction);
    }
  }
  return {sum * (kPi / directions), from_surface * (kPi / directions), static_cast<float>(metal_hits) / directions,
          std::move(floor_hits), kTypicalAlbedo / static_cast<float>(directions)};
}

float IrradianceModel::visibility(const PointLight& light, float distance_m, const Eigen::Vector3f& position_m,
                                  const Eigen::Vector3f& normal, int rays) const {
  const bool far = distance_m == kInfinitelyFar;
  const float distance = far ? kShadingParameters.max_ray_m : distance_m;
  const Eigen::Vector3f centre = (far ? position_m : surroundings_.probe) + distance * light.direction;
  const Eigen::Vector3f offset = centre - position_m;
  if (!(normal.dot(offset) > 0)) return 0;
  const Eigen::Vector3f from = position_m + lift_m_ * normal;
  const float radius = std::tan(light.angular_radius_rad) * distance;
  const Frame frame = frame_around(offset.normalized());
  const Eigen::Vector3f end = centre - kShadingParameters.lamp_radii_clear * radius * frame.z;
  int lit = 0;
  for (int i = 0; i < rays; ++i) {
    const float rho = rays == 1 ? 0 : radius * std::sqrt((i + 0.5f) / rays), phi = kGolden * i;
    lit += rays_.free(from, end + rho * std::cos(phi) * frame.x + rho * std::sin(phi) * frame.y);
  }
  return static_cast<float>(lit) / rays;
}

int IrradianceModel::rays_for(float share, int rays) {
  return std::clamp(static_cast<int>(std::ceil(2 * share * static_cast<float>(rays))), 1, rays);
}

bool IrradianceModel::passes_unobserved_space(const PointLight& light, const Eigen::Vector3f& position_m,
                                              const Eigen::Vector3f& normal) const {
  const Eigen::Vector3f from = position_m + lift_m_ * normal;
  const Eigen::Vector3f offset = light.distance_known ? Eigen::Vector3f(light.position_m - from) : light.direction;
  const float far_m = light.distance_known ? std::min(offset.norm(), kUnobserved.range_m) : kUnobserved.range_m;
  const Eigen::Vector3f direction = offset.normalized();
  float unobserved_m = 0;
  for (float t = kUnobserved.start_m; t < far_m; t += kUnobserved.step_m) {
    unobserved_m = hidden_from_all(field_.seen_space, from + t * direction) ? unobserved_m + kUnobserved.step_m : 0;
    if (unobserved_m >= kUnobserved.min_width_m) return true;
  }
  return false;
}

}  // namespace lumigraft::reconstruct
