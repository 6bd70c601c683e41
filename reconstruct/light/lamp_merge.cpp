#include "reconstruct/light/lamp_merge.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "reconstruct/light/parameters.h"

namespace lumigraft::reconstruct {
namespace {

bool same_lamp(const PointLight& piece, const PointLight& joined) {
  return piece.region < 0 ? piece.id == joined.id : piece.region == joined.region;
}

/// Solid angle of a cone over 2π: 1 - cos(half angle).
float cone_fraction(float half_angle_rad) { return 1 - std::cos(half_angle_rad); }

PointLight merge(const PointLight& a, const PointLight& b) {
  PointLight both = a;
  both.id = std::min(a.id, b.id);
  const float wa = a.irradiance.mean(), wb = b.irradiance.mean(), all = std::max(wa + wb, 1e-12f);
  both.direction = (wa * a.direction + wb * b.direction).normalized();
  both.irradiance = a.irradiance + b.irradiance;
  both.angular_radius_rad =
      std::acos(std::clamp(1 - cone_fraction(a.angular_radius_rad) - cone_fraction(b.angular_radius_rad), -1.0f, 1.0f));
  both.clipped = a.clipped || b.clipped;
  both.position_m = (wa * a.position_m + wb * b.position_m) / all;
  both.outline_u = both.outline_v = Eigen::Vector3f::Zero();
  both.squareness = (wa * a.squareness + wb * b.squareness) / all;
  return both;
}

/// Distance along the piece's direction to the plane of its lamp; empty if that is not flat or the piece cannot lie on
/// it.
std::optional<float> plane_distance_m(const PointLight& piece, const PointLight& lamp, const Eigen::Vector3f& probe_m) {
  if (!lamp.flat) return std::nullopt;
  const Eigen::Vector3f to = lamp.position_m - probe_m;
  const float lamp_m = to.norm(), plane_m = lamp.normal.dot(to) / lamp.normal.dot(piece.direction);
  constexpr float kMaxRatio = kLightParameters.merge.max_plane_distance_ratio;
  return plane_m > lamp_m / kMaxRatio && plane_m < lamp_m * kMaxRatio ? std::optional(plane_m) : std::nullopt;
}

}  // namespace

void set_distance(PointLight& light, float distance_m, const Eigen::Vector3f& probe_m) {
  light.distance_known = true;
  light.position_m = probe_m + distance_m * light.direction;
  light.intensity = light.irradiance * distance_m * distance_m;
  light.radius_m = distance_m * std::tan(light.angular_radius_rad);
}

void place_as(PointLight& piece, const PointLight& lamp, const Eigen::Vector3f& probe_m) {
  const std::optional<float> plane_m = plane_distance_m(piece, lamp, probe_m);
  set_distance(piece, plane_m.value_or((lamp.position_m - probe_m).norm()), probe_m);
  piece.distance_log_sigma = lamp.distance_log_sigma;
  piece.flat = plane_m.has_value();
  piece.normal = lamp.normal;
}

std::vector<PointLight> merge_pieces(const std::vector<PointLight>& pieces) {
  std::vector<PointLight> joined;
  for (const PointLight& piece : pieces) {
    const auto lamp =
        std::find_if(joined.begin(), joined.end(), [&](const PointLight& light) { return same_lamp(piece, light); });
    if (lamp == joined.end()) {
      joined.push_back(piece);
    } else {
      *lamp = merge(*lamp, piece);
    }
  }
  return joined;
}

std::vector<PointLight> place_pieces(const std::vector<PointLight>& pieces, const std::vector<PointLight>& joined,
                                     const std::vector<PointLight>& placed, const Eigen::Vector3f& probe_m) {
  std::vector<PointLight> result = pieces;
  for (PointLight& piece : result) {
    const auto before =
        std::find_if(joined.begin(), joined.end(), [&](const PointLight& light) { return same_lamp(piece, light); });
    const PointLight& lamp = placed[static_cast<std::size_t>(before - joined.begin())];
    piece.irradiance =
        piece.irradiance.cwiseProduct(lamp.irradiance.cwiseQuotient(before->irradiance.cwiseMax(1e-12f)));
    piece.power_log_sigma = lamp.power_log_sigma;
    piece.distance_known = lamp.distance_known;
    if (piece.distance_known) place_as(piece, lamp, probe_m);
  }
  return result;
}

}  // namespace lumigraft::reconstruct
