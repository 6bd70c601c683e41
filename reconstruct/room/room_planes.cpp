#include "reconstruct/room/room_planes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr const RoomParameters::Mirrors& kRoomPlanes = kRoomParameters.mirrors;

/// Least-squares fit of the plane to the points on it; returns their number, 0 if too few.
std::size_t fit_plane(RoomPlane& plane, const std::vector<RoomPoint>& points) {
  std::size_t count = 0;
  for (int round = 0; round < kRoomPlanes.fit_rounds; ++round) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    count = 0;
    for (const RoomPoint& p : points) {
      if (!plane.holds(p)) continue;
      const Eigen::Vector3d position = p.position_m.cast<double>();
      sum += position;
      squares += position * position.transpose();
      ++count;
    }
    if (count < kRoomPlanes.min_points_on_plane) return 0;
    const Eigen::Vector3d middle = sum / static_cast<double>(count);
    const Eigen::Matrix3d spread = squares / static_cast<double>(count) - middle * middle.transpose();
    const Vector3f across = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0).cast<float>();
    plane.normal = across.dot(plane.normal) < 0 ? -across : across;
    plane.offset_m = -plane.normal.dot(middle.cast<float>());
  }
  return count;
}

}  // namespace

std::vector<RoomPlane> planes_of(const std::vector<RoomPoint>& points) {
  std::vector<RoomPlane> planes;
  const std::size_t step = std::max<std::size_t>(points.size() / kRoomPlanes.seeds, 1);
  for (std::size_t seed = 0; seed < points.size(); seed += step) {
    const RoomPoint& p = points[seed];
    const bool known =
        std::any_of(planes.begin(), planes.end(), [&](const RoomPlane& plane) { return plane.holds(p); });
    if (known) continue;
    RoomPlane plane{p.normal, -p.normal.dot(p.position_m)};
    if (fit_plane(plane, points) == 0) continue;
    const bool same = std::any_of(planes.begin(), planes.end(), [&](const RoomPlane& other) {
      return other.normal.dot(plane.normal) > kRoomPlanes.duplicate_cosine &&
             std::abs(other.offset_m - plane.offset_m) < kRoomPlanes.plane_tolerance_m;
    });
    if (!same) planes.push_back(plane);
  }
  return planes;
}

}  // namespace lumigraft::reconstruct
