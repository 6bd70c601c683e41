#include "tests/bench/comparators/imperfect_shadow_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumigraft::comparators {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr int kLevels = 3;            // of pull-push: larger holes count as sky
constexpr float kSameSurface = 0.1f;  // relative depth: texels farther behind are not mixed in
constexpr float kGrazing = 0.05f;  // sine of the elevation above the light's plane, below which a disc may intersect it
constexpr float kWidestSplat = 0.125f;  // of the map's edge
constexpr float kSteepest = 10;         // slope of a disc against the direction in which it is seen
constexpr float kSlack = 0.05f;         // of the depth

/// Paraboloid map: z projects to the centre, the horizon to the inscribed circle.
Vector2f on_paraboloid(const Vector3f& w, float edge) {
  return edge * (0.5f * w.head<2>() / (1 + w.z()) + Vector2f::Constant(0.5f));
}

}  // namespace

ScenePoints scatter_points(const std::vector<relight::ReferenceMesh>& meshes, int count, std::uint32_t seed) {
  struct Triangle {
    Vector3f a, ab, ac, normal;
  };
  ScenePoints result;
  std::vector<Triangle> triangles;
  std::vector<double> areas_m2;  // cumulative
  double sum = 0;
  for (const relight::ReferenceMesh& mesh : meshes) {
    const relight::Model& model = *mesh.model;
    for (std::size_t i = 0; i + 2 < model.indices.size(); i += 3) {
      const auto corner = [&](std::size_t k) { return mesh.T_tag_model * model.positions_m[model.indices[i + k]]; };
      const Vector3f a = corner(0), ab = corner(1) - a, ac = corner(2) - a, n = ab.cross(ac);
      if (!(n.norm() > 0)) continue;
      triangles.push_back({a, ab, ac, n.normalized()});
      areas_m2.push_back(sum += 0.5 * n.norm());
    }
  }
  result.area_m2 = static_cast<float>(sum);
  for (int i = 0; i < count && !triangles.empty(); ++i) {
    relight::Sampler sampler(seed, 1, static_cast<std::uint32_t>(i));
    const auto found = std::upper_bound(areas_m2.begin(), areas_m2.end(), sum * sampler.one());
    const auto last = static_cast<std::ptrdiff_t>(triangles.size()) - 1;
    const Triangle& t = triangles[static_cast<std::size_t>(std::min(found - areas_m2.begin(), last))];
    const Vector2f u = sampler.two();
    const float root = std::sqrt(u.x());
    result.points.push_back({t.a + root * (1 - u.y()) * t.ab + root * u.y() * t.ac, t.normal});
  }
  return result;
}

ImperfectShadowMap::ImperfectShadowMap(int edge_texels) : edge_(edge_texels) {}

void ImperfectShadowMap::clear(const VirtualLight& light) {
  light_ = light;
  Vector3f x, y;
  relight::basis(light.normal, x, y);
  turn_.row(0) = x;
  turn_.row(1) = y;
  turn_.row(2) = light.normal;
  depth_m_.assign(static_cast<std::size_t>(edge_) * static_cast<std::size_t>(edge_), kNothing);
}

void ImperfectShadowMap::draw(const ScenePoints& points, std::size_t first, std::size_t count) {
  const std::size_t all = points.points.size();
  count = std::min(count, all);
  if (count == 0) return;
  const float disc_m = std::sqrt(points.area_m2 / (relight::kPi * static_cast<float>(count)));
  const float edge = static_cast<float>(edge_);
  for (std::size_t i = 0; i < count; ++i) {
    const ScenePoint& point = points.points[(first + i) % all];
    const Vector3f to = turn_ * (point.position_m - light_.position_m);
    const float far_m = to.norm();
    if (!(to.z() > kGrazing * far_m && far_m > disc_m)) continue;
    const Vector3f w = to / far_m;
    const Vector2f at = on_paraboloid(w, edge);
    const float facing = std::abs(point.normal.dot(point.position_m - light_.position_m)) / far_m;
    // The map's scale along the meridian is edge / (1 + cos); a disc seen obliquely is narrower.
    const float texel_rad = (1 + w.z()) / edge;
    const float half_rad = std::min(disc_m * std::sqrt(facing) / far_m, kWidestSplat * (1 + w.z()));
    const float half = half_rad / texel_rad;
    const auto low = [&](float x) { return std::clamp(static_cast<int>(std::ceil(x - half - 0.5f)), 0, edge_ - 1); };
    const auto high = [&](float x) { return std::clamp(static_cast<int>(std::floor(x + half - 0.5f)), 0, edge_ - 1); };
    // Depth of the disc's plane at the splat's edge plus one texel.
    const float slope = std::min(std::sqrt(std::max(1 - facing * facing, 0.0f)) / std::max(facing, 1e-3f), kSteepest);
    const float depth_m = far_m * (1 + slope * (half_rad + texel_rad)) + disc_m;
    const auto set = [&](int u, int v) {
      float& texel = depth_m_[static_cast<std::size_t>(v * edge_ + u)];
      texel = std::min(texel, depth_m);
    };
    set(std::min(static_cast<int>(at.x()), edge_ - 1), std::min(static_cast<int>(at.y()), edge_ - 1));
    for (int v = low(at.y()); v <= high(at.y()); ++v) {
      for (int u = low(at.x()); u <= high(at.x()); ++u) set(u, v);
    }
  }
}

void ImperfectShadowMap::fill_holes() {
  std::vector<std::vector<float>> levels{std::move(depth_m_)};
  for (int level = 1, edge = edge_ / 2; level <= kLevels && edge > 0; ++level, edge /= 2) {  // pull
    const std::vector<float>& fine = levels.back();
    std::vector<float> coarse(static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge), kNothing);
    for (int v = 0; v < edge; ++v) {
      for (int u = 0; u < edge; ++u) {
        float texels[4], nearest = kNothing, farthest = 0;
        for (int i = 0; i < 4; ++i) {
          texels[i] = fine[static_cast<std::size_t>((2 * v + i / 2) * 2 * edge + 2 * u + i % 2)];
          nearest = std::min(nearest, texels[i]);
        }
        for (const float texel : texels) {
          // The maximum over one surface: otherwise oblique surfaces shadow themselves.
          if (texel <= (1 + kSameSurface) * nearest && texel < kNothing) farthest = std::max(farthest, texel);
        }
        if (farthest > 0) coarse[static_cast<std::size_t>(v * edge + u)] = farthest;
      }
    }
    levels.push_back(std::move(coarse));
  }
  for (std::size_t level = levels.size() - 1; level > 0; --level) {  // push
    const std::vector<float>& coarse = levels[level];
    std::vector<float>& fine = levels[level - 1];
    const auto edge = static_cast<std::size_t>(edge_ >> (level - 1));
    for (std::size_t i = 0; i < fine.size(); ++i) {
      if (fine[i] == kNothing) fine[i] = coarse[(i / edge / 2) * (edge / 2) + i % edge / 2];
    }
  }
  depth_m_ = std::move(levels.front());
}

bool ImperfectShadowMap::open(const Vector3f& p_m) const {
  const Vector3f to = turn_ * (p_m - light_.position_m);
  const float far_m = to.norm();
  if (!(to.z() > 0)) return false;
  const Vector2f at = on_paraboloid(to / far_m, static_cast<float>(edge_));
  const int u = std::clamp(static_cast<int>(at.x()), 0, edge_ - 1),
            v = std::clamp(static_cast<int>(at.y()), 0, edge_ - 1);
  return far_m <= (1 + kSlack) * depth_m_[static_cast<std::size_t>(v * edge_ + u)];
}

}  // namespace lumigraft::comparators
