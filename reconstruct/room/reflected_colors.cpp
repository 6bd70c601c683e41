#include "reconstruct/room/reflected_colors.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "reconstruct/room/parameters.h"
#include "reconstruct/room/room_planes.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::MatrixXf;
using Eigen::Vector3f;
using Eigen::VectorXf;

constexpr const RoomParameters::Mirrors& kRays = kRoomParameters.mirrors;
constexpr const RoomParameters::ReflectedColors& kColors = kRoomParameters.reflected_colors;

/// Whether the camera sees a point of the surface; `view` is the unit direction towards it.
bool sees(const Vector3f& camera, const Vector3f& view, float distance_m, const DistanceField& field) {
  const auto hit = field.raycast(camera, view, kRays.first_ray_m, distance_m + kRays.tolerance_m);
  return !hit || hit->distance_m >= distance_m - kRays.tolerance_m;
}

/// Mean radiance of the known surface that cameras see reflected at the point; empty if there is none.
std::optional<Vector3f> reflected_radiance(const RoomPoint& p, const RoomPlane& plane, const DistanceField& field,
                                           const std::vector<Vector3f>& cameras_m) {
  Vector3f sum = Vector3f::Zero();
  int count = 0;
  for (const Vector3f& camera : cameras_m) {
    const Vector3f offset = p.position_m - camera;
    const float distance_m = offset.norm();
    if (plane.height_m(camera) <= 0 || distance_m < kRays.min_ray_m) continue;
    const Vector3f view = offset / distance_m;
    if (!sees(camera, view, distance_m, field)) continue;
    const Vector3f reflected = view - 2 * plane.normal.dot(view) * plane.normal;
    const auto hit = field.raycast(p.position_m, reflected, kRays.first_ray_m, kRays.ray_beyond_m);
    const auto radiance = hit ? field.radiance(hit->position_m) : std::nullopt;
    if (!radiance) continue;
    sum += *radiance;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return Vector3f(sum / static_cast<float>(count));
}

/// Points of a plane, one row each.
struct Observations {
  MatrixXf position_m{0, 2};  ///< in the plane, from their mean
  MatrixXf observed{0, 3}, reflected{0, 3};
  Vector3f middle_m = Vector3f::Zero();
};

Observations observe(const RoomPlane& plane, const std::vector<RoomPoint>& points, const DistanceField& field,
                     const std::vector<Vector3f>& cameras_m) {
  struct Seen {
    Vector3f at_m, observed, reflected;
  };
  std::vector<Seen> all;
  const std::size_t step = (points.size() + kColors.max_points - 1) / kColors.max_points;
  for (std::size_t i = 0; i < points.size(); i += step) {
    const auto observed = field.radiance(points[i].position_m);
    const auto reflected = observed ? reflected_radiance(points[i], plane, field, cameras_m) : std::nullopt;
    if (reflected) all.push_back({points[i].position_m, *observed, *reflected});
  }
  Observations o;
  const auto n = static_cast<Eigen::Index>(all.size());
  o.position_m.resize(n, 2);
  o.observed.resize(n, 3);
  o.reflected.resize(n, 3);
  for (const Seen& s : all) o.middle_m += s.at_m / static_cast<float>(n);
  const Vector3f x = plane.normal.unitOrthogonal(), y = plane.normal.cross(x);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Seen& s = all[static_cast<std::size_t>(i)];
    o.position_m.row(i) << (s.at_m - o.middle_m).dot(x), (s.at_m - o.middle_m).dot(y);
    o.observed.row(i) = s.observed;
    o.reflected.row(i) = s.reflected;
  }
  return o;
}

/// What least squares over the columns of `terms` leaves of each column of `values`, one below the other.
VectorXf residuals(const MatrixXf& terms, const MatrixXf& values) {
  const MatrixXf left = values - terms * terms.colPivHouseholderQr().solve(values);
  return Eigen::Map<const VectorXf>(left.data(), left.size());
}

MatrixXf differences(const MatrixXf& colors) {
  MatrixXf d(colors.rows(), 2);
  d << colors.col(0) - colors.col(1), colors.col(2) - colors.col(1);
  return d;
}

Regression regress(const VectorXf& observed, const VectorXf& reflected) {
  const float shared = observed.dot(reflected), power = reflected.squaredNorm();
  if (power <= 0 || observed.squaredNorm() <= 0) return {};
  return {shared / power, shared / std::sqrt(power * observed.squaredNorm())};
}

bool explains(const Regression& r) {
  return r.slope >= kColors.min_reflectance && r.correlation >= kColors.min_correlation;
}

std::optional<ReflectingPlane> reflection_in(const RoomPlane& plane, const std::vector<RoomPoint>& points,
                                             const DistanceField& field, const std::vector<Vector3f>& cameras_m) {
  const Observations o = observe(plane, points, field, cameras_m);
  const Eigen::Index n = o.position_m.rows();
  if (n < kColors.min_points) return std::nullopt;
  const auto x = o.position_m.col(0).array(), y = o.position_m.col(1).array();
  MatrixXf trend(n, 6), trend_and_luminance(n, 7);
  trend << MatrixXf::Ones(n, 1), o.position_m, (x * x).matrix(), (x * y).matrix(), (y * y).matrix();
  const MatrixXf luminance = o.observed.rowwise().mean();
  trend_and_luminance << trend, luminance;
  ReflectingPlane found;
  found.plane = plane;
  found.middle_m = o.middle_m;
  found.points = static_cast<int>(n);
  found.luminance = regress(residuals(trend, luminance), residuals(trend, o.reflected.rowwise().mean()));
  found.hue = regress(residuals(trend_and_luminance, differences(o.observed)),
                      residuals(trend_and_luminance, differences(o.reflected)));
  if (!explains(found.luminance) || !explains(found.hue)) return std::nullopt;
  return found;
}

}  // namespace

std::vector<ReflectingPlane> find_reflecting_planes(const std::vector<RoomPoint>& points, const DistanceField& field,
                                                    const MetalMask& metal) {
  std::vector<Vector3f> cameras_m;
  const std::size_t step = (field.seen_from_m.size() + kColors.max_cameras - 1) / kColors.max_cameras;
  for (std::size_t i = 0; i < field.seen_from_m.size(); i += step) cameras_m.push_back(field.seen_from_m[i]);
  std::vector<ReflectingPlane> found;
  for (const RoomPlane& plane : planes_of(points)) {
    std::vector<RoomPoint> unnamed;
    std::copy_if(points.begin(), points.end(), std::back_inserter(unnamed),
                 [&](const RoomPoint& p) { return plane.holds(p) && !metal.contains(p.position_m); });
    if (const auto reflecting = reflection_in(plane, unnamed, field, cameras_m)) found.push_back(*reflecting);
  }
  return found;
}

}  // namespace lumigraft::reconstruct
