#include "reconstruct/room/mirror_detection.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kSeeds = 60;                  // tried as a plane's place
constexpr std::size_t kMostChecked = 1000;          // points behind a plane
constexpr float kOnPlane_m = 0.02f;                 // so far from it
constexpr float kAlike = 0.95f;                     // cosine of the normals of points on it
constexpr float kSamePlane = 0.98f;                 // and of planes tried before
constexpr std::size_t kLeastOnPlane = 40;           // points, each of about 10 cm²
constexpr int kSectors = 8, kLeastSectors = 6;      // around a hole, that hold some of the plane
constexpr float kAround_m = 1;                      // and so near
constexpr float kBehind_m = 0.06f;                  // what is nearer may be the plane itself
constexpr float kOff_m = 0.02f, kOffShare = 0.02f;  // of a reflection, and by so much of its way from the plane
constexpr float kSameWay = 0.7f;                    // cosine of its normal with that of what it is said to reflect
constexpr int kLeastConfirmed = 20;
constexpr float kMostDenied = 0.15f;  // of what is confirmed or denied

struct Plane {
  Vector3f normal;
  float offset_m;
  float height(const Vector3f& p) const { return normal.dot(p) + offset_m; }
  bool holds(const RoomPoint& p) const {
    return p.normal.dot(normal) > kAlike && std::abs(height(p.position_m)) < kOnPlane_m;
  }
  Vector3f reflected(const Vector3f& p) const { return p - 2 * height(p) * normal; }
};

/// The plane through the points on it, least squares; how many there are.
std::size_t settle(Plane& plane, const std::vector<RoomPoint>& points) {
  std::size_t count = 0;
  for (int round = 0; round < 3; ++round) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    count = 0;
    for (const RoomPoint& p : points) {
      if (!plane.holds(p)) continue;
      const Eigen::Vector3d place = p.position_m.cast<double>();
      sum += place;
      squares += place * place.transpose();
      ++count;
    }
    if (count < kLeastOnPlane) return 0;
    const Eigen::Vector3d middle = sum / static_cast<double>(count);
    const Eigen::Matrix3d spread = squares / static_cast<double>(count) - middle * middle.transpose();
    const Vector3f across = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0).cast<float>();
    plane.normal = across.dot(plane.normal) < 0 ? -across : across;
    plane.offset_m = -plane.normal.dot(middle.cast<float>());
  }
  return count;
}

/// Planes in the order of their first point.
std::vector<Plane> planes_of(const std::vector<RoomPoint>& points) {
  std::vector<Plane> planes;
  const std::size_t step = std::max<std::size_t>(points.size() / kSeeds, 1);
  for (std::size_t seed = 0; seed < points.size(); seed += step) {
    const RoomPoint& p = points[seed];
    const bool known = std::any_of(planes.begin(), planes.end(), [&](const Plane& plane) { return plane.holds(p); });
    if (known) continue;
    Plane plane{p.normal, -p.normal.dot(p.position_m)};
    if (settle(plane, points) == 0) continue;
    const bool same = std::any_of(planes.begin(), planes.end(), [&](const Plane& other) {
      return other.normal.dot(plane.normal) > kSamePlane && std::abs(other.offset_m - plane.offset_m) < kOnPlane_m;
    });
    if (!same) planes.push_back(plane);
  }
  return planes;
}

/// Whether a place on the plane has the plane's surface around it: what is seen through it is seen through a hole.
bool surrounded(const Vector3f& place, const std::vector<Vector3f>& surface, const Plane& plane) {
  const Vector3f x = plane.normal.unitOrthogonal(), y = plane.normal.cross(x);
  unsigned sectors = 0;
  for (const Vector3f& p : surface) {
    const Vector3f way = p - place;
    if (way.squaredNorm() > kAround_m * kAround_m) continue;
    const float turn = std::atan2(way.dot(y), way.dot(x)) / (2 * std::numbers::pi_v<float>)+0.5f;
    sectors |= 1u << std::min(static_cast<int>(kSectors * turn), kSectors - 1);
  }
  return std::popcount(sectors) >= kLeastSectors;
}

/// Where on the plane a camera looked through it and saw the point.
std::optional<Vector3f> looked_through(const RoomPoint& p, const Plane& plane, const DistanceField& field) {
  const float depth_m = -plane.height(p.position_m);
  for (const Vector3f& camera : field.seen_from_m) {
    const Vector3f way = p.position_m - camera;
    const float before_m = plane.height(camera), distance_m = way.norm();
    if (before_m <= 0 || p.normal.dot(way) >= 0) continue;
    const auto hit = field.raycast(camera, way / distance_m, 0.05f, distance_m + kOff_m);
    if (hit && hit->distance_m < distance_m - kOff_m) continue;
    return p.position_m - depth_m / (depth_m + before_m) * way;
  }
  return std::nullopt;
}

enum class Reflection { confirmed, denied, unknown };

Reflection judge(const RoomPoint& p, const Plane& plane, const DistanceField& field) {
  const Vector3f place = plane.reflected(p.position_m);
  const Vector3f normal = p.normal - 2 * plane.normal.dot(p.normal) * plane.normal;
  const float off_m = kOff_m + kOffShare * std::abs(plane.height(p.position_m));
  if (const auto sample = field.sample(place)) {
    const auto there = field.normal(place);
    if (std::abs(sample->distance_m) < off_m && there && there->dot(normal) > kSameWay) return Reflection::confirmed;
  }
  for (const Vector3f& camera : field.seen_from_m) {
    const Vector3f way = place - camera;
    const float distance_m = way.norm();
    if (distance_m < 0.1f) continue;
    const auto hit = field.raycast(camera, way / distance_m, 0.05f, distance_m + 6);
    if (hit && hit->distance_m > distance_m + 2 * off_m) return Reflection::denied;
  }
  return Reflection::unknown;
}

std::optional<DetectedMirror> mirror_in(const Plane& plane, const std::vector<RoomPoint>& points,
                                        const DistanceField& field) {
  std::vector<RoomPoint> behind;
  std::vector<Vector3f> surface;
  for (const RoomPoint& p : points) {
    if (plane.holds(p)) surface.push_back(p.position_m);
    if (plane.height(p.position_m) < -kBehind_m) behind.push_back(p);
  }
  DetectedMirror mirror;
  mirror.normal = plane.normal;
  std::vector<Vector3f> through;
  const std::size_t step = (behind.size() + kMostChecked - 1) / kMostChecked;
  for (std::size_t i = 0; i < behind.size(); i += step) {
    const auto place = looked_through(behind[i], plane, field);
    if (!place || !surrounded(*place, surface, plane)) continue;
    const Reflection found = judge(behind[i], plane, field);
    mirror.denied += found == Reflection::denied;
    if (found != Reflection::confirmed) continue;
    ++mirror.confirmed;
    through.push_back(*place);
  }
  if (mirror.confirmed < kLeastConfirmed ||
      static_cast<float>(mirror.denied) > kMostDenied * static_cast<float>(mirror.confirmed + mirror.denied))
    return std::nullopt;
  for (const Vector3f& p : through) mirror.middle_m += p / static_cast<float>(through.size());
  return mirror;
}

}  // namespace

std::vector<DetectedMirror> suspected_mirrors(const std::vector<RoomPoint>& points, const DistanceField& field) {
  std::vector<DetectedMirror> mirrors;
  for (const Plane& plane : planes_of(points))
    if (const auto mirror = mirror_in(plane, points, field)) mirrors.push_back(*mirror);
  std::stable_sort(mirrors.begin(), mirrors.end(),
                   [](const DetectedMirror& a, const DetectedMirror& b) { return a.confirmed > b.confirmed; });
  return mirrors;
}

std::vector<std::string> mirror_warnings(const std::vector<RoomPoint>& points, const DistanceField& field) {
  std::vector<std::string> lines;
  for (const DetectedMirror& mirror : suspected_mirrors(points, field)) {
    char line[256];
    std::snprintf(line, sizeof line,
                  "depth goes through the wall at (%.2f, %.2f, %.2f) m and shows behind it what stands before it: if a "
                  "mirror hangs there, name it as a [[real_surface]]",
                  mirror.middle_m.x(), mirror.middle_m.y(), mirror.middle_m.z());
    lines.emplace_back(line);
  }
  return lines;
}

}  // namespace lumigraft::reconstruct
