#include "reconstruct/room/mirror_detection.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>

#include "capture/message_text.h"
#include "reconstruct/room/parameters.h"
#include "reconstruct/room/room_planes.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr const RoomParameters::Mirrors& kMirrors = kRoomParameters.mirrors;
constexpr int kSectors = 8;  // of the circle around a hole

/// Whether a point of the plane is surrounded by the plane's surface: a view through it is a view through a hole.
bool surrounded(const Vector3f& point, const std::vector<Vector3f>& surface, const RoomPlane& plane) {
  const Vector3f x = plane.normal.unitOrthogonal(), y = plane.normal.cross(x);
  unsigned sectors = 0;
  for (const Vector3f& p : surface) {
    const Vector3f offset = p - point;
    if (offset.squaredNorm() > kMirrors.surround_m * kMirrors.surround_m) continue;
    const float turn = std::atan2(offset.dot(y), offset.dot(x)) / (2 * std::numbers::pi_v<float>)+0.5f;
    sectors |= 1u << std::min(static_cast<int>(kSectors * turn), kSectors - 1);
  }
  return std::popcount(sectors) >= kMirrors.min_sectors;
}

/// Where a ray from a camera that saw the point crosses the plane; empty if no camera saw it through the plane.
std::optional<Vector3f> crossing_of_view(const RoomPoint& p, const RoomPlane& plane, const DistanceField& field) {
  const float depth_m = -plane.height_m(p.position_m);
  for (const Vector3f& camera : field.seen_from_m) {
    const Vector3f offset = p.position_m - camera;
    const float before_m = plane.height_m(camera), distance_m = offset.norm();
    if (before_m <= 0 || p.normal.dot(offset) >= 0) continue;
    const auto hit =
        field.raycast(camera, offset / distance_m, kMirrors.first_ray_m, distance_m + kMirrors.tolerance_m);
    if (hit && hit->distance_m < distance_m - kMirrors.tolerance_m) continue;
    return p.position_m - depth_m / (depth_m + before_m) * offset;
  }
  return std::nullopt;
}

enum class Evidence { confirms, contradicts, none };

/// Whether a point behind the plane is the reflection of something in front of it.
Evidence evidence_of(const RoomPoint& p, const RoomPlane& plane, const DistanceField& field) {
  const Vector3f reflected = plane.reflected(p.position_m);
  const Vector3f normal = p.normal - 2 * plane.normal.dot(p.normal) * plane.normal;
  const float off_m = kMirrors.tolerance_m + kMirrors.tolerance_ratio * std::abs(plane.height_m(p.position_m));
  if (const auto sample = field.sample(reflected)) {
    const auto there = field.normal(reflected);
    if (std::abs(sample->distance_m) < off_m && there && there->dot(normal) > kMirrors.same_normal_cosine)
      return Evidence::confirms;
  }
  for (const Vector3f& camera : field.seen_from_m) {
    const Vector3f offset = reflected - camera;
    const float distance_m = offset.norm();
    if (distance_m < kMirrors.min_ray_m) continue;
    const auto hit =
        field.raycast(camera, offset / distance_m, kMirrors.first_ray_m, distance_m + kMirrors.ray_beyond_m);
    if (hit && hit->distance_m > distance_m + 2 * off_m) return Evidence::contradicts;
  }
  return Evidence::none;
}

std::optional<DetectedMirror> mirror_in(const RoomPlane& plane, const std::vector<RoomPoint>& points,
                                        const DistanceField& field) {
  std::vector<RoomPoint> behind;
  std::vector<Vector3f> surface;
  for (const RoomPoint& p : points) {
    if (plane.holds(p)) surface.push_back(p.position_m);
    if (plane.height_m(p.position_m) < -kMirrors.min_depth_m) behind.push_back(p);
  }
  DetectedMirror mirror;
  mirror.normal = plane.normal;
  std::vector<Vector3f> through;
  const std::size_t step = (behind.size() + kMirrors.max_points - 1) / kMirrors.max_points;
  for (std::size_t i = 0; i < behind.size(); i += step) {
    const auto crossing = crossing_of_view(behind[i], plane, field);
    if (!crossing || !surrounded(*crossing, surface, plane)) continue;
    const Evidence found = evidence_of(behind[i], plane, field);
    mirror.contradicted += found == Evidence::contradicts;
    if (found != Evidence::confirms) continue;
    ++mirror.confirmed;
    through.push_back(*crossing);
  }
  if (mirror.confirmed < kMirrors.min_confirmed ||
      static_cast<float>(mirror.contradicted) >
          kMirrors.max_contradicted * static_cast<float>(mirror.confirmed + mirror.contradicted))
    return std::nullopt;
  for (const Vector3f& p : through) mirror.middle_m += p / static_cast<float>(through.size());
  return mirror;
}

}  // namespace

std::vector<DetectedMirror> find_mirrors(const std::vector<RoomPoint>& points, const DistanceField& field) {
  std::vector<DetectedMirror> mirrors;
  for (const RoomPlane& plane : planes_of(points))
    if (const auto mirror = mirror_in(plane, points, field)) mirrors.push_back(*mirror);
  std::stable_sort(mirrors.begin(), mirrors.end(),
                   [](const DetectedMirror& a, const DetectedMirror& b) { return a.confirmed > b.confirmed; });
  return mirrors;
}

std::vector<std::string> mirror_warnings(const std::vector<RoomPoint>& points, const DistanceField& field,
                                         const std::vector<ReflectingPlane>& reflecting) {
  std::vector<std::string> lines;
  for (const DetectedMirror& mirror : find_mirrors(points, field))
    lines.push_back(capture::formatted(
        "depth behind the wall at (%.2f, %.2f, %.2f) m repeats what is in front of it: if there is a mirror, "
        "configure it as a [[real_surface]]",
        mirror.middle_m.x(), mirror.middle_m.y(), mirror.middle_m.z()));
  for (const ReflectingPlane& plane : reflecting)
    lines.push_back(capture::formatted(
        "the surface at (%.2f, %.2f, %.2f) m shows what is in front of it as a mirror does: if it is one, configure it "
        "as a [[real_surface]]",
        plane.middle_m.x(), plane.middle_m.y(), plane.middle_m.z()));
  return lines;
}

}  // namespace lumigraft::reconstruct
