#include "reconstruct/albedo_irradiance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/light_environment.h"

namespace lumigraft {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kGolden = 2.39996323f;  ///< golden angle: Vogel's spiral on the lamp's disk
constexpr float kRoom_m = 10;           ///< longest ray
constexpr float kLiftVoxels = 1.5f;

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

/// A picture in which cells that show something near are filled from the cells nearest to them that do not: seen from
/// elsewhere the near thing stands in another direction, where rays meet it in the field.
EnvironmentPicture without_near(const EnvironmentPicture& picture, const FieldRays& rays,
                                const Eigen::Vector3f& probe) {
  const Image<float>& from = picture.radiance;
  EnvironmentPicture result = picture;
  std::vector<std::size_t> far, near;
  std::vector<Eigen::Vector3f> directions;
  for (int v = 0; v < from.height; ++v) {
    for (int u = 0; u < from.width; ++u) {
      directions.push_back(environment_direction(u, v, from.width, from.height));
      const bool hit = rays.first_crossing(probe, directions.back(), kRoom_m).has_value();
      (hit ? near : far).push_back(directions.size() - 1);
    }
  }
  if (far.empty()) return result;
  for (const std::size_t cell : near) {
    // Weights fall fast with the angle, so the nearest cells decide.
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float weights = 0;
    for (std::size_t i = cell % 7; i < far.size(); i += 7) {
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

}  // namespace

RoomLight::RoomLight(const DistanceField& field, const FieldRays& rays, const MetalSurfaces& metal,
                     const Illumination& illumination)
    : field_(field),
      rays_(rays),
      metal_(metal),
      probe_(illumination.probe_position_m),
      lift_m_(kLiftVoxels * field.voxel_m),
      far_(without_near(illumination.remainder, rays, illumination.probe_position_m)) {}

RoomLight::Gathered RoomLight::gather(const Eigen::Vector3f& position_m, const Eigen::Vector3f& normal,
                                      int directions) const {
  const Frame frame = frame_around(normal);
  const Eigen::Vector3f from = position_m + lift_m_ * normal;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int on_metal = 0;
  for (int i = 0; i < directions; ++i) {
    const float s = (i + 0.5f) / directions, phi = 2 * kPi * radical_inverse(static_cast<std::uint32_t>(i));
    const float r = std::sqrt(s);
    const Eigen::Vector3f direction =
        (r * std::cos(phi) * frame.x + r * std::sin(phi) * frame.y + std::sqrt(1 - s) * frame.z).normalized();
    const auto hit = rays_.first_crossing(from, direction, kRoom_m);
    const auto radiance = hit ? field_.radiance(*hit) : std::nullopt;
    sum += radiance ? *radiance : far_radiance(direction);
    on_metal += hit && metal_.contains(*hit);
  }
  return {sum * (kPi / directions), static_cast<float>(on_metal) / directions};
}

float RoomLight::visibility(const PointLight& light, float distance_m, const Eigen::Vector3f& position_m,
                            const Eigen::Vector3f& normal, int rays) const {
  const bool far = distance_m == kInfinitelyFar;
  const float distance = far ? kRoom_m : distance_m;
  const Eigen::Vector3f centre = (far ? position_m : probe_) + distance * light.direction;
  const Eigen::Vector3f way = centre - position_m;
  if (!(normal.dot(way) > 0)) return 0;
  const Eigen::Vector3f from = position_m + lift_m_ * normal;
  const float radius = std::tan(light.angular_radius_rad) * distance;
  const Frame frame = frame_around(way.normalized());
  const Eigen::Vector3f end = centre - 1.5f * radius * frame.z;  // the lamp's own body casts no shadow
  int lit = 0;
  for (int i = 0; i < rays; ++i) {
    const float rho = rays == 1 ? 0 : radius * std::sqrt((i + 0.5f) / rays), phi = kGolden * i;
    lit += rays_.free(from, end + rho * std::cos(phi) * frame.x + rho * std::sin(phi) * frame.y);
  }
  return static_cast<float>(lit) / rays;
}

std::optional<Eigen::Vector3f> RoomLight::in_front_of(const PointLight& light) const {
  return rays_.first_crossing(probe_, light.direction, kRoom_m);
}

}  // namespace lumigraft
