#include "reconstruct/light/lamp_merge.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace lumigraft::reconstruct {
namespace {

constexpr float kMostApart = 2;  ///< of a flat piece's distance, over the whole's, either way: beyond it is no plane

bool same_lamp(const PointLight& piece, const PointLight& joined) {
  return piece.region < 0 ? piece.id == joined.id : piece.region == joined.region;
}

/// 1 - cos of the half angle, which is the solid angle over 2π.
float cap(float half_angle_rad) { return 1 - std::cos(half_angle_rad); }

PointLight join(const PointLight& a, const PointLight& b) {
  PointLight both = a;
  both.id = std::min(a.id, b.id);
  const float wa = a.irradiance.mean(), wb = b.irradiance.mean(), all = std::max(wa + wb, 1e-12f);
  both.direction = (wa * a.direction + wb * b.direction).normalized();
  both.irradiance = a.irradiance + b.irradiance;
  both.angular_radius_rad =
      std::acos(std::clamp(1 - cap(a.angular_radius_rad) - cap(b.angular_radius_rad), -1.0f, 1.0f));
  both.clipped = a.clipped || b.clipped;
  both.position_m = (wa * a.position_m + wb * b.position_m) / all;
  both.squareness = (wa * a.squareness + wb * b.squareness) / all;
  return both;
}

/// Along the piece's direction to the whole's plane; empty where that is no plane, or not one the piece can lie on.
std::optional<float> on_plane(const PointLight& piece, const PointLight& whole, const Eigen::Vector3f& probe_m) {
  if (!whole.flat) return std::nullopt;
  const Eigen::Vector3f to = whole.position_m - probe_m;
  const float whole_m = to.norm(), plane_m = whole.normal.dot(to) / whole.normal.dot(piece.direction);
  return plane_m > whole_m / kMostApart && plane_m < whole_m * kMostApart ? std::optional(plane_m) : std::nullopt;
}

}  // namespace

std::vector<PointLight> join_pieces(const std::vector<PointLight>& pieces) {
  std::vector<PointLight> joined;
  for (const PointLight& piece : pieces) {
    const auto whole =
        std::find_if(joined.begin(), joined.end(), [&](const PointLight& light) { return same_lamp(piece, light); });
    if (whole == joined.end()) {
      joined.push_back(piece);
    } else {
      *whole = join(*whole, piece);
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
    const PointLight& whole = placed[static_cast<std::size_t>(before - joined.begin())];
    piece.irradiance =
        piece.irradiance.cwiseProduct(whole.irradiance.cwiseQuotient(before->irradiance.cwiseMax(1e-12f)));
    piece.power_log_sigma = whole.power_log_sigma;
    piece.distance_known = whole.distance_known;
    if (!piece.distance_known) continue;
    const std::optional<float> plane_m = on_plane(piece, whole, probe_m);
    const float distance_m = plane_m.value_or((whole.position_m - probe_m).norm());
    piece.position_m = probe_m + distance_m * piece.direction;
    piece.intensity = piece.irradiance * distance_m * distance_m;
    piece.radius_m = distance_m * std::tan(piece.angular_radius_rad);
    piece.distance_log_sigma = whole.distance_log_sigma;
    piece.flat = plane_m.has_value();
    piece.normal = whole.normal;
  }
  return result;
}

}  // namespace lumigraft::reconstruct
