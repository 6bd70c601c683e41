#include "reconstruct/lamps/seen_lamps.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "reconstruct/lamps/parameters.h"
#include "reconstruct/light/lamp_merge.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr const LampParameters::Seen& kSeen = kLampParameters.seen;
constexpr float kGolden = 2.39996323f;  ///< golden angle: Vogel's spiral on the lamp's disk

float radiance_of(const PointLight& lamp) {
  const float solid_angle_sr =
      2 * std::numbers::pi_v<float> * (1 - std::cos(std::max(lamp.angular_radius_rad, kSeen.min_radius_rad)));
  return lamp.irradiance.mean() / solid_angle_sr;
}

enum class Brightness { dark, clipped, lamp };

/// Of a voxel near the surface, compared with a lamp's radiance.
Brightness brightness(const FieldBrick& brick, std::size_t index, float lamp_radiance) {
  const float mean = brick.radiance(index).mean();
  if (brick.radiance_weight(index) > 0)
    return mean * kSeen.max_contrast > lamp_radiance ? Brightness::lamp : Brightness::dark;
  return mean > 0 ? Brightness::clipped : Brightness::dark;
}

/// The level of the field that has surface at a point.
const DistanceField& level_at(const DistanceField& field, const Vector3f& position_m) {
  return field.coarse && !field.has_brick_at(position_m) ? *field.coarse : field;
}
Vector3i voxel_at(const DistanceField& level, const Vector3f& position_m) {
  return (position_m / level.voxel_m).array().round().cast<int>();
}

Brightness brightness_at(const DistanceField& field, const Vector3f& position_m, float lamp_radiance) {
  const DistanceField& level = level_at(field, position_m);
  const Vector3i voxel = voxel_at(level, position_m);
  const FieldBrick* brick = level.brick(brick_of(voxel));
  return brick ? brightness(*brick, static_cast<std::size_t>(index_in_brick(voxel)), lamp_radiance) : Brightness::dark;
}

/// Surface on a ray from the fish-eye towards a lamp.
struct Spot {
  Vector3f position_m;
  float distance_m, off_axis;  ///< from the fish-eye; from the disk's centre, over its radius
};

struct Disk {
  std::vector<Spot> bright;
  bool covered = false;  ///< most of it is bright surface
};

Disk surface_on_disk(const DistanceField& field, const PointLight& lamp, const Illumination& light) {
  const Vector3f x = lamp.direction.unitOrthogonal(), y = lamp.direction.cross(x);
  const float tangent = std::tan(lamp.angular_radius_rad), radiance = radiance_of(lamp);
  const auto direction_at = [&](float off_axis, float phi) {
    return (lamp.direction + off_axis * tangent * (std::cos(phi) * x + std::sin(phi) * y)).normalized();
  };
  const auto hit_at = [&](const Vector3f& direction) {
    return field.raycast(light.probe_position_m, direction, 0, kSeen.max_ray_m);
  };
  Disk disk;
  int clipped = 0;
  for (int i = 0; i < kSeen.rays; ++i) {
    const float off_axis = kSeen.disk_reach * std::sqrt((i + 0.5f) / kSeen.rays);
    const auto hit = hit_at(direction_at(off_axis, kGolden * static_cast<float>(i)));
    const Brightness bright = hit ? brightness_at(field, hit->position_m, radiance) : Brightness::dark;
    if (bright == Brightness::dark) continue;
    clipped += bright == Brightness::clipped;
    disk.bright.push_back({hit->position_m, hit->distance_m, off_axis});
  }
  disk.covered = 2 * disk.bright.size() > static_cast<std::size_t>(kSeen.rays);
  if (!disk.covered || clipped == 0) return disk;
  // What is clipped may be as dark as a wall, which is larger than the lamp before it.
  int beyond = 0, others = 0;
  for (int i = 0; i < kSeen.rays; ++i) {
    const Vector3f direction =
        direction_at(kSeen.beyond, 2 * std::numbers::pi_v<float> * static_cast<float>(i) / kSeen.rays);
    const bool other = std::any_of(light.lights.begin(), light.lights.end(), [&](const PointLight& l) {
      return &l != &lamp && l.direction.dot(direction) > std::cos(l.angular_radius_rad);
    });
    const auto hit = hit_at(direction);
    beyond += !other && hit && brightness_at(field, hit->position_m, radiance) != Brightness::dark;
    others += other;
  }
  disk.covered = 2 * beyond <= kSeen.rays - others;
  return disk;
}

struct Plane {
  Vector3f point_m, normal;
  float rms_m;
};
Plane fit_plane(const std::vector<Spot>& spots) {
  Vector3f mean = Vector3f::Zero();
  for (const Spot& spot : spots) mean += spot.position_m / static_cast<float>(spots.size());
  Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
  for (const Spot& spot : spots) scatter += (spot.position_m - mean) * (spot.position_m - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> eigen(scatter);
  return {mean, eigen.eigenvectors().col(0),
          std::sqrt(std::max(0.0f, eigen.eigenvalues()[0]) / static_cast<float>(spots.size()))};
}

/// A ball whose disk this is.
struct Ball {
  float distance_m, rms_m;  ///< of its centre from the fish-eye
};
Ball fit_ball(const std::vector<Spot>& spots, float tangent) {
  std::vector<float> fronts;
  for (const Spot& spot : spots) {
    const float bulge = 1 - std::sqrt(1 - spot.off_axis * spot.off_axis);
    fronts.push_back(spot.distance_m / (1 + tangent * bulge));
  }
  const float front_m = median(fronts);
  float squares = 0;
  for (const float distance_m : fronts) squares += (distance_m - front_m) * (distance_m - front_m);
  return {front_m * (1 + tangent), std::sqrt(squares / static_cast<float>(fronts.size()))};
}

void place(PointLight& lamp, const std::vector<Spot>& spots, const Vector3f& probe_m, float voxel_m) {
  const float tangent = std::tan(lamp.angular_radius_rad);
  Plane plane = fit_plane(spots);
  const Ball ball = fit_ball(spots, tangent);
  const float cosine = plane.normal.dot(lamp.direction), radius_m = ball.distance_m * tangent;
  // The surface of a smaller lamp does not show its shape.
  const bool resolved = radius_m > kSeen.resolved_voxels * voxel_m;
  lamp.flat = resolved && plane.rms_m < ball.rms_m && std::abs(cosine) > kMinSlantCosine;
  const float distance_m = lamp.flat ? plane.normal.dot(plane.point_m - probe_m) / cosine : ball.distance_m;
  if (lamp.flat) lamp.normal = cosine < 0 ? plane.normal : (-plane.normal).eval();
  const float error_m = std::hypot(voxel_m, std::min(plane.rms_m, ball.rms_m), resolved ? 0 : 0.5f * radius_m);
  lamp.distance_log_sigma = error_m / distance_m;
  set_distance(lamp, distance_m, probe_m);
}

/// Voxels of one level by their distance from a set, in steps to one of 26 neighbours.
class Spread {
 public:
  explicit Spread(const DistanceField& level) : level_(level) {}

  /// The bright surface that is connected with these voxels, within a ball.
  void fill(std::vector<Vector3i> layer, float lamp_radiance, const Vector3f& centre_m, float reach_m) {
    std::erase_if(layer, [&](const Vector3i& voxel) { return !mark(voxel); });
    while (!layer.empty()) {
      surface_.insert(surface_.end(), layer.begin(), layer.end());
      layer = next(layer, [&](const Vector3i& voxel, const FieldBrick& brick, std::size_t i) {
        return std::abs(brick.distance_m[i]) < level_.voxel_m &&
               brightness(brick, i, lamp_radiance) != Brightness::dark &&
               (level_.voxel_m * voxel.cast<float>() - centre_m).norm() < reach_m;
      });
    }
  }
  /// All voxels whose nearest surface is that one, or adjacent to it, where colours are interpolated between both.
  SurfaceMask::Voxels around() {
    std::vector<Vector3i> layer = surface_;
    const float last = std::ceil(level_.truncation_m / level_.voxel_m) + kSeen.mixed_voxels;
    for (float steps = 1; steps <= last; ++steps)
      layer = next(layer, [&](const Vector3i&, const FieldBrick& brick, std::size_t i) {
        return steps <= std::abs(brick.distance_m[i]) / level_.voxel_m + kSeen.mixed_voxels;
      });
    return std::move(marked_);
  }
  bool empty() const { return surface_.empty(); }

 private:
  bool mark(const Vector3i& voxel) {
    std::bitset<kBrickVoxels>& marks = marked_[brick_of(voxel)];
    const auto i = static_cast<std::size_t>(index_in_brick(voxel));
    if (marks[i]) return false;
    return marks[i] = true;
  }
  template <typename Belongs>
  std::vector<Vector3i> next(const std::vector<Vector3i>& layer, Belongs belongs) {
    std::vector<Vector3i> result;
    for (const Vector3i& voxel : layer)
      for (int k = 0; k < 27; ++k) {
        const Vector3i neighbour = voxel + Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        const FieldBrick* brick = level_.brick(brick_of(neighbour));
        const auto i = static_cast<std::size_t>(index_in_brick(neighbour));
        if (brick && brick->weight[i] > 0 && belongs(neighbour, *brick, i) && mark(neighbour))
          result.push_back(neighbour);
      }
    return result;
  }

  const DistanceField& level_;
  std::vector<Vector3i> surface_;
  SurfaceMask::Voxels marked_;
};

SurfaceMask surface_of(const DistanceField& field, const PointLight& lamp, const std::vector<Spot>& spots) {
  std::vector<Vector3i> fine, coarse;
  for (const Spot& spot : spots) {
    const DistanceField& level = level_at(field, spot.position_m);
    (&level == &field ? fine : coarse).push_back(voxel_at(level, spot.position_m));
  }
  const auto voxels = [&](const DistanceField& level, std::vector<Vector3i> start) {
    Spread spread(level);
    spread.fill(std::move(start), radiance_of(lamp), lamp.position_m,
                kSeen.max_reach * lamp.radius_m + kSeen.mixed_voxels * level.voxel_m);
    return spread.around();
  };
  SurfaceMask mask;
  if (!fine.empty()) mask.fine = voxels(field, std::move(fine));
  if (!coarse.empty()) mask.coarse = voxels(*field.coarse, std::move(coarse));
  return mask;
}

}  // namespace

std::optional<SeenLamps::Seen> SeenLamps::look(const DistanceField& field, const PointLight& lamp,
                                               const Illumination& light) {
  const Disk disk = surface_on_disk(field, lamp, light);
  if (!disk.covered) return std::nullopt;
  Seen seen{lamp, {}};
  place(seen.lamp, disk.bright, light.probe_position_m, level_at(field, disk.bright.front().position_m).voxel_m);
  seen.surface = surface_of(field, seen.lamp, disk.bright);
  return seen;
}

SeenLamps::Result SeenLamps::find(const DistanceField& field, const std::shared_ptr<const Illumination>& light) {
  std::map<int, Seen> found;
  SurfaceMask mask;
  for (const PointLight& lamp : light->lights) {
    if (light->from_shading || lamp.visibility != PointLight::Visibility::visible) continue;
    const auto before = seen_.find(lamp.id);
    std::optional<Seen> seen;
    if (!lamp.covered && lamp.hidden == 0)
      seen = look(field, lamp, *light);
    else if (before != seen_.end())
      seen = before->second;
    if (!seen) continue;
    mask.add(seen->surface);
    found.emplace(lamp.id, *std::move(seen));
  }
  seen_ = std::move(found);
  if (seen_.empty()) {
    surface_ = nullptr;
    return {light, nullptr};
  }
  if (!surface_ || !(*surface_ == mask)) surface_ = std::make_shared<SurfaceMask>(std::move(mask));
  auto placed = std::make_shared<Illumination>(*light);
  for (PointLight& lamp : placed->lights) {
    if (lamp.distance_known) continue;
    const auto seen = std::find_if(seen_.begin(), seen_.end(), [&](const auto& entry) {
      return entry.first == lamp.id || (lamp.region >= 0 && entry.second.lamp.region == lamp.region);
    });
    if (seen != seen_.end()) place_as(lamp, seen->second.lamp, light->probe_position_m);
  }
  return {std::move(placed), surface_};
}

}  // namespace lumigraft::reconstruct
