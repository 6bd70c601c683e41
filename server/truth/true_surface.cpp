#include "server/truth/true_surface.h"

#include <cmath>
#include <limits>

#include "server/truth/parameters.h"

namespace lumigraft::server {
namespace {

bool any(std::uint32_t, const Eigen::Vector3f&) { return true; }

std::vector<reconstruct::RoomPoint> points_on(const relight::Model& model) {
  const auto corner = [&](std::size_t i) { return model.positions_m[model.indices[i]]; };
  const auto across = [&](std::size_t i) -> Eigen::Vector3f {  // the triangle's normal times twice its area
    return (corner(i + 1) - corner(i)).cross(corner(i + 2) - corner(i));
  };
  double area_m2 = 0;
  for (std::size_t i = 0; i < model.indices.size(); i += 3) area_m2 += 0.5 * across(i).norm();

  // Rows of points over the parallelogram of the edges at the first corner; points beyond the third edge are mirrored
  // back.
  std::vector<reconstruct::RoomPoint> points;
  double owed = 0;
  for (std::size_t i = 0; i < model.indices.size(); i += 3) {
    owed += 0.5 * across(i).norm() / area_m2 * kTruth.points;
    const auto edge = static_cast<int>(std::sqrt(owed));
    owed -= edge * edge;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    for (std::size_t j = i; j < i + 3; ++j) normal += model.normals[model.indices[j]];
    if (edge == 0 || normal.isZero()) continue;
    normal.normalize();
    for (int k = 0; k < edge * edge; ++k) {
      float a = (static_cast<float>(k % edge) + 0.5f) / static_cast<float>(edge);
      float b = (static_cast<float>(k / edge) + 0.25f) / static_cast<float>(edge);
      if (a + b > 1) {
        a = 1 - a;
        b = 1 - b;
      }
      points.push_back({corner(i) + a * (corner(i + 1) - corner(i)) + b * (corner(i + 2) - corner(i)), normal});
    }
  }
  return points;
}

}  // namespace

TrueSurface::TrueSurface(const std::filesystem::path& real_scene_ply)
    : model_(relight::load_model(real_scene_ply, 'z')), triangles_(*model_), points_(points_on(*model_)) {}

std::vector<reconstruct::RoomPoint> TrueSurface::seen_from(const Eigen::Vector3f& eye_m) const {
  std::vector<reconstruct::RoomPoint> seen;
  for (const reconstruct::RoomPoint& point : points_) {
    const Eigen::Vector3f from = point.position_m + kTruth.ray_offset_m * point.normal, to = eye_m - from;
    if (to.dot(point.normal) > 0 && !triangles_.first_hit(from, to.normalized(), to.norm(), any)) seen.push_back(point);
  }
  return seen;
}

bool TrueSurface::hides(const Eigen::Vector3f& eye_m, const Eigen::Vector3f& direction) const {
  return triangles_.first_hit(eye_m, direction, std::numeric_limits<float>::max(), any).has_value();
}

}  // namespace lumigraft::server
