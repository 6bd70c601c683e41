#include "reconstruct/shading/irradiance.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "reconstruct/light/environment.h"
#include "reconstruct/room/enclosure.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kGolden = 2.39996323f;  ///< golden angle: Vogel's spiral on the lamp's disk
constexpr float kFloorAlbedo = 0.35f;   ///< of a floor that nobody saw: what rooms usually are made of
constexpr int kFloorSquares = 60;       ///< along either edge; beyond them the lamps' light is not counted
constexpr float kSquare_m = 0.15f;      ///< edge of one
constexpr float kAboveFloor_m = 0.05f;  ///< it is known to about so much
constexpr float kUsual_m = 1.5f;        ///< distance of a lamp of which it is not known
constexpr float kFloorShare = 0.02f;    ///< of the known surface, that may lie below the floor: noise
/// How far from a point what nobody saw may cover a lamp, looked at in these steps; and how wide hidden space is.
constexpr float kHiddenFar_m = 1.0f, kHiddenStep_m = 0.015f, kHiddenWide_m = 0.03f;
constexpr float kRoom_m = 10;     ///< longest ray
constexpr int kCorner = 2;        ///< measured sides that tell how a room lies: one alone may be a table's
constexpr float kOnSide = 0.97f;  ///< of the way to a side of the enclosure: there
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
EnvironmentMap without_near(const EnvironmentMap& picture, const FieldRays& rays, const Eigen::Vector3f& probe,
                            const Enclosure* room) {
  const capture::Image<float>& from = picture.radiance;
  EnvironmentMap result = picture;
  std::vector<std::size_t> far, near;
  std::vector<Eigen::Vector3f> directions;
  for (int v = 0; v < from.height; ++v) {
    for (int u = 0; u < from.width; ++u) {
      directions.push_back(environment_direction(u, v, from.width, from.height));
      const auto hit = rays.first_crossing(probe, directions.back(), kRoom_m);
      const auto exit = hit && room ? room->leave(probe, directions.back()) : std::nullopt;
      const bool before = hit && !(exit && (*hit - probe).norm() > kOnSide * exit->distance_m);
      (before ? near : far).push_back(directions.size() - 1);
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

int cell_of(const Eigen::Vector3f& direction, int width, int height) {
  const float phi = std::atan2(direction.y(), direction.x()), theta = std::acos(std::clamp(direction.z(), -1.0f, 1.0f));
  const int u = static_cast<int>((phi / kPi + 1) * 0.5f * static_cast<float>(width)),
            v = static_cast<int>(theta / kPi * static_cast<float>(height));
  return std::clamp(v, 0, height - 1) * width + std::clamp(u, 0, width - 1);
}

}  // namespace

IrradianceModel::IrradianceModel(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                 const Illumination& illumination, const Enclosure* room)
    : field_(field),
      rays_(rays),
      metal_(metal),
      enclosure_(room),
      lift_m_(kLiftVoxels * field.voxel_m),
      beyond_{illumination.probe_position_m,
              without_near(illumination.environment, rays, illumination.probe_position_m, room)} {
  beyond_.guessed = room && std::count_if(room->sides.begin(), room->sides.end(),
                                          [](const Enclosure::Side& side) { return side.measured; }) >= kCorner;
  const EnvironmentMap& whole = illumination.environment;
  if (std::all_of(whole.seen.data.begin(), whole.seen.data.end(), [](std::uint8_t seen) { return seen != 0; })) return;
  const int width = whole.seen.width, height = whole.seen.height;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      if (whole.seen.at(u, v))
        beyond_.up += environment_solid_angle_sr(v, width, height) * environment_direction(u, v, width, height);
  beyond_.up.normalize();
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (!whole.seen.at(u, v)) continue;
      const float cosine = std::max(0.0f, beyond_.up.dot(environment_direction(u, v, width, height)));
      beyond_.on_floor += cosine * environment_solid_angle_sr(v, width, height) *
                          Eigen::Map<const Eigen::Vector3f>(&whole.radiance.data[whole.radiance.index(u, v)]);
    }
  }
  std::vector<float> heights;
  for (const RoomPoint& point : room_points(field)) heights.push_back(beyond_.up.dot(point.position_m));
  beyond_.floor_m = beyond_.up.dot(beyond_.probe);
  if (heights.empty()) return;
  const auto low = heights.begin() + static_cast<std::ptrdiff_t>(kFloorShare * static_cast<float>(heights.size()));
  std::nth_element(heights.begin(), low, heights.end());
  beyond_.floor_m = std::min(beyond_.floor_m, *low);
}

IrradianceModel::IrradianceModel(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                 const Enclosure* room, Beyond beyond)
    : field_(field),
      rays_(rays),
      metal_(metal),
      enclosure_(room),
      lift_m_(kLiftVoxels * field.voxel_m),
      beyond_(std::move(beyond)) {}

Eigen::Vector3f IrradianceModel::far_radiance(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction) const {
  const auto exit = enclosure_ ? enclosure_->leave(from_m, direction) : std::nullopt;
  const bool measured = exit && enclosure_->sides[exit->side].measured;
  if (!measured && !(exit && beyond_.guessed)) return beyond_.far.sample(direction);
  const Eigen::Vector3f there =
      beyond_.far.sample((from_m + exit->distance_m * direction - beyond_.probe).stableNormalized());
  return measured ? there : (0.5f * (there + beyond_.far.sample(direction))).eval();
}

std::optional<Eigen::Vector3f> IrradianceModel::floor_ahead(const Eigen::Vector3f& from_m,
                                                            const Eigen::Vector3f& direction) const {
  const float fall = -beyond_.up.dot(direction), above_m = beyond_.up.dot(from_m) - beyond_.floor_m;
  if (fall < 1e-3f || above_m < 0) return std::nullopt;
  if (beyond_.far.seen
          .data[static_cast<std::size_t>(cell_of(direction, beyond_.far.seen.width, beyond_.far.seen.height))])
    return std::nullopt;
  return from_m + above_m / fall * direction;
}

std::vector<Eigen::Vector3f> IrradianceModel::light_on_floor(const std::vector<PointLight>& lamps) const {
  std::vector<Eigen::Vector3f> squares(kFloorSquares * kFloorSquares, Eigen::Vector3f::Zero());
  if (beyond_.up.isZero()) return squares;
  const Frame frame = frame_around(beyond_.up);
  const Eigen::Vector3f middle =
      beyond_.probe + (beyond_.floor_m + kAboveFloor_m - beyond_.up.dot(beyond_.probe)) * beyond_.up;
  for (int i = 0; i < kFloorSquares * kFloorSquares; ++i) {
    const auto across = [&](int k) { return (static_cast<float>(k) + 0.5f - 0.5f * kFloorSquares) * kSquare_m; };
    const Eigen::Vector3f place = middle + across(i % kFloorSquares) * frame.x + across(i / kFloorSquares) * frame.y;
    for (const PointLight& lamp : lamps) {
      const Eigen::Vector3f at = lamp.distance_known ? lamp.position_m : beyond_.probe + kUsual_m * lamp.direction;
      const Eigen::Vector3f way = place - at, towards = way.normalized();
      const float arriving = std::max(0.0f, -beyond_.up.dot(towards)) * lamp.emission(towards);
      if (arriving <= 0 || !rays_.free(place, at + (1.5f * lamp.radius_m + lift_m_) * towards)) continue;
      squares[static_cast<std::size_t>(i)] +=
          arriving * (at - beyond_.probe).squaredNorm() / way.squaredNorm() * lamp.irradiance;
    }
  }
  return squares;
}

Eigen::Vector3f IrradianceModel::by_floor(const Gathered& gathered,
                                          const std::vector<Eigen::Vector3f>& on_floor) const {
  if (gathered.on_floor.empty()) return Eigen::Vector3f::Zero();
  const Frame frame = frame_around(beyond_.up);
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const Eigen::Vector3f& place : gathered.on_floor) {
    const Eigen::Vector3f way = (place - beyond_.probe) / kSquare_m;
    const auto x = static_cast<int>(std::floor(way.dot(frame.x) + 0.5f * kFloorSquares)),
               y = static_cast<int>(std::floor(way.dot(frame.y) + 0.5f * kFloorSquares));
    if (x < 0 || y < 0 || x >= kFloorSquares || y >= kFloorSquares) continue;
    sum += on_floor[static_cast<std::size_t>(x + kFloorSquares * y)];
  }
  return gathered.floor_share * sum;
}

IrradianceModel::Gathered IrradianceModel::gather(const Eigen::Vector3f& position_m, const Eigen::Vector3f& normal,
                                                  int directions) const {
  const Frame frame = frame_around(normal);
  const Eigen::Vector3f from = position_m + lift_m_ * normal;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int on_metal = 0;
  std::vector<Eigen::Vector3f> on_floor;
  for (int i = 0; i < directions; ++i) {
    const float s = (i + 0.5f) / directions, phi = 2 * kPi * radical_inverse(static_cast<std::uint32_t>(i));
    const float r = std::sqrt(s);
    const Eigen::Vector3f direction =
        (r * std::cos(phi) * frame.x + r * std::sin(phi) * frame.y + std::sqrt(1 - s) * frame.z).normalized();
    const auto hit = rays_.first_crossing(from, direction, kRoom_m);
    const auto radiance = hit ? field_.radiance(*hit) : std::nullopt;
    on_metal += hit && metal_.contains(*hit);
    if (radiance) {
      sum += *radiance;
    } else if (const auto floor = hit ? std::nullopt : floor_ahead(from, direction)) {
      sum += kFloorAlbedo / kPi * beyond_.on_floor;
      on_floor.push_back(*floor);
    } else {
      sum += far_radiance(from, direction);
    }
  }
  return {sum * (kPi / directions), static_cast<float>(on_metal) / directions, std::move(on_floor),
          kFloorAlbedo / static_cast<float>(directions)};
}

float IrradianceModel::visibility(const PointLight& light, float distance_m, const Eigen::Vector3f& position_m,
                                  const Eigen::Vector3f& normal, int rays) const {
  const bool far = distance_m == kInfinitelyFar;
  const float distance = far ? kRoom_m : distance_m;
  const Eigen::Vector3f centre = (far ? position_m : beyond_.probe) + distance * light.direction;
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

bool IrradianceModel::hidden_way(const PointLight& light, const Eigen::Vector3f& position_m,
                                 const Eigen::Vector3f& normal) const {
  if (field_.seen_from_m.empty()) return false;
  const Eigen::Vector3f from = position_m + lift_m_ * normal;
  const Eigen::Vector3f way = light.distance_known ? Eigen::Vector3f(light.position_m - from) : light.direction;
  const float far_m = light.distance_known ? std::min(way.norm(), kHiddenFar_m) : kHiddenFar_m;
  const Eigen::Vector3f direction = way.normalized();
  float hidden_m = 0;
  for (float t = 2 * kHiddenStep_m; t < far_m; t += kHiddenStep_m) {
    const Eigen::Vector3f at = from + t * direction;
    const bool seen = std::any_of(field_.seen_from_m.begin(), field_.seen_from_m.end(),
                                  [&](const Eigen::Vector3f& camera_m) { return rays_.free(camera_m, at); });
    hidden_m = seen ? 0 : hidden_m + kHiddenStep_m;
    if (hidden_m > kHiddenWide_m) return true;
  }
  return false;
}

}  // namespace lumigraft::reconstruct
