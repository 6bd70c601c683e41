#include "relight/tracing/emissive_surface.h"

#include <algorithm>
#include <cmath>

#include "relight/tracing/bsdf.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr int kEdgePoints = 4;  // a triangle's mean emission is that of the square of as many points

/// Uniform over a triangle for uniform u (Turk 1990).
Vector3f barycentric_of(const Vector2f& u) {
  const float root = std::sqrt(u.x());
  return {1 - root, root * (1 - u.y()), root * u.y()};
}

/// The two edges at a triangle's first corner.
std::pair<Vector3f, Vector3f> edges(const Model& model, std::uint32_t triangle) {
  const std::uint32_t* corner = &model.indices[3 * std::size_t{triangle}];
  const Vector3f& first = model.positions_m[corner[0]];
  return {model.positions_m[corner[1]] - first, model.positions_m[corner[2]] - first};
}

bool may_emit(const Model& model, const MaterialOverride& material) {
  if (material.emission) return material.emission->maxCoeff() > 0;
  return std::ranges::any_of(model.parts, [](const Model::Part& p) { return p.material.emission.maxCoeff() > 0; });
}

}  // namespace

std::shared_ptr<const EmissiveSurface> EmissiveSurface::of(const Model& model, const MaterialOverride& material) {
  if (!may_emit(model, material)) return nullptr;
  std::shared_ptr<const EmissiveSurface> made(new EmissiveSurface(model, material));
  return made->power() > 0 ? made : nullptr;
}

EmissiveSurface::EmissiveSurface(const Model& model, const MaterialOverride& material)
    : model_(model), material_(material), surface_(model, /*mips=*/false), pdf_(model.indices.size() / 3, 0) {
  std::vector<float> shares;
  for (std::uint32_t t = 0; t < pdf_.size(); ++t) {
    if (material_.over(model.parts[surface_.part(t)].material).emission.maxCoeff() <= 0) continue;
    float mean = 0;
    for (int i = 0; i < kEdgePoints * kEdgePoints; ++i) {
      const Vector2f u = (Vector2f(i % kEdgePoints, i / kEdgePoints).array() + 0.5f) / kEdgePoints;
      const Vector3f emission = surface_.at({t, barycentric_of(u), 0}, material_).material.emission;
      mean += luminance(emission.array()) / (kEdgePoints * kEdgePoints);
    }
    const auto [a, b] = edges(model, t);
    const float area_m2 = a.cross(b).norm() / 2;
    if (!(mean * area_m2 > 0)) continue;
    triangles_.push_back(t);
    shares.push_back(mean * area_m2);
    power_ += shares.back();
    area_m2_ += area_m2;
    pdf_[t] = mean;
  }
  float sum = 0;
  for (const float share : shares) until_.push_back((sum += share) / power_);
  for (float& pdf : pdf_) pdf /= power_;
}

EmissiveSurface::Point EmissiveSurface::sample(const Vector2f& u) const {
  const auto found = std::min(std::ranges::upper_bound(until_, u.x()), until_.end() - 1);
  const float before = found == until_.begin() ? 0 : *(found - 1);
  const float rest = std::clamp((u.x() - before) / (*found - before), 0.0f, 1.0f);
  Point point;
  point.triangle = triangles_[static_cast<std::size_t>(found - until_.begin())];
  point.barycentric = barycentric_of({rest, u.y()});
  point.pdf = pdf_[point.triangle];
  const auto [a, b] = edges(model_, point.triangle);
  const std::uint32_t first = model_.indices[3 * std::size_t{point.triangle}];
  point.position_m = model_.positions_m[first] + point.barycentric[1] * a + point.barycentric[2] * b;
  const ModelSurface::Shading shading = surface_.at({point.triangle, point.barycentric, 0}, material_);
  point.normal = a.cross(b).stableNormalized();
  if (point.normal.dot(shading.interpolated) < 0) point.normal = -point.normal;
  point.emission = shading.material.emission;
  return point;
}

}  // namespace lumigraft::relight
