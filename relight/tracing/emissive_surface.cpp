#include "relight/tracing/emissive_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "relight/tracing/bsdf.h"
#include "relight/tracing/parameters.h"
#include "relight/tracing/sampler.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr std::uint32_t kPatchSeed = 41;

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

/// Bits of the coordinates in turn (Morton 1966): places that are near in this order are near in space.
std::uint32_t morton(const Eigen::Array3f& unit) {
  constexpr int kBits = 10;
  const Eigen::Array3i cell = (unit.max(0).min(0x1.fffffep-1f) * (1 << kBits)).cast<int>();
  std::uint32_t code = 0;
  for (int bit = kBits - 1; bit >= 0; --bit) {
    for (int axis = 0; axis < 3; ++axis) code = code << 1 | (static_cast<std::uint32_t>(cell[axis]) >> bit & 1);
  }
  return code;
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
  struct Emitting {
    std::uint32_t place, triangle;
    float power;
  };
  std::vector<Emitting> found;
  double power = 0;  // sums of millions of triangles
  Eigen::AlignedBox3f box;
  for (const Vector3f& p : model.positions_m) box.extend(p);
  const Eigen::Array3f sizes = box.sizes().array().max(1e-12f);
  for (std::uint32_t t = 0; t < pdf_.size(); ++t) {
    const Model::Part& part = model.parts[surface_.part(t)];
    const Vector3f factor = material_.over(part.material).emission;
    if (factor.maxCoeff() <= 0) continue;
    const bool textured = (!material_.emission && part.emissive_texture.picture) || part.blends();
    const float mean = luminance(factor.array()) * (textured ? std::max(mean_of_texture(t), kTracing.min_emission) : 1);
    const auto [a, b] = edges(model, t);
    const float area_m2 = a.cross(b).norm() / 2;
    if (!(mean * area_m2 > 0)) continue;
    const Vector3f centre = model.positions_m[model.indices[3 * std::size_t{t}]] + (a + b) / 3;
    found.push_back({morton((centre - box.min()).array() / sizes), t, mean * area_m2});
    power += static_cast<double>(mean * area_m2);
    pdf_[t] = mean;
  }
  // In this order, strata of u are compact parts of the surface.
  std::ranges::sort(found, {}, [](const Emitting& e) { return std::pair(e.place, e.triangle); });
  double sum = 0;
  for (const Emitting& e : found) {
    triangles_.push_back(e.triangle);
    cumulative_power_.push_back(static_cast<float>((sum += static_cast<double>(e.power)) / power));
  }
  power_ = static_cast<float>(power);
  for (float& pdf : pdf_) pdf /= power_;
  if (triangles_.empty()) return;
  cumulative_power_.back() = 1;
  for (std::size_t i = 0; i < kPatches; ++i) {
    Patch& patch = patches_.emplace_back();
    for (int k = 0; k < kTracing.emission_patch_points; ++k) {
      const Vector2f u = Sampler(kPatchSeed, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k)).two();
      const Point p = sample({(static_cast<float>(i) + u.x()) / kPatches, u.y()});
      patch.position_m += p.position_m / static_cast<float>(kTracing.emission_patch_points);
      patch.normal += p.normal / static_cast<float>(kTracing.emission_patch_points);
      patch.emission += (1 - coat_share_evenly(p.clearcoat)) * p.emission / p.pdf /
                        static_cast<float>(kTracing.emission_patch_points);
      patch.pdf += 1 / p.pdf / static_cast<float>(kTracing.emission_patch_points);
    }
    patch.emission /= patch.pdf;
    patch.pdf = 1 / patch.pdf;
  }
}

float EmissiveSurface::mean_of_texture(std::uint32_t triangle) const {
  const Vector3f factor = material_.over(model_.parts[surface_.part(triangle)].material).emission;
  float sum = 0;
  for (int i = 0; i < kTracing.emission_edge_points * kTracing.emission_edge_points; ++i) {
    const Vector2f u = (Vector2f(i % kTracing.emission_edge_points, i / kTracing.emission_edge_points).array() + 0.5f) /
                       kTracing.emission_edge_points;
    const ModelSurface::Shading shading = surface_.at({triangle, barycentric_of(u), 0}, material_);
    sum += shading.opacity * luminance(shading.material.emission.array());
  }
  return sum / (kTracing.emission_edge_points * kTracing.emission_edge_points * luminance(factor.array()));
}

EmissiveSurface::Point EmissiveSurface::sample(const Vector2f& u) const {
  const auto found = std::min(std::ranges::upper_bound(cumulative_power_, u.x()), cumulative_power_.end() - 1);
  const float before = found == cumulative_power_.begin() ? 0 : *(found - 1);
  const float rest = std::clamp((u.x() - before) / (*found - before), 0.0f, 1.0f);
  Point point;
  point.triangle = triangles_[static_cast<std::size_t>(found - cumulative_power_.begin())];
  point.barycentric = barycentric_of({rest, u.y()});
  point.pdf = pdf_[point.triangle];
  const auto [a, b] = edges(model_, point.triangle);
  const std::uint32_t first = model_.indices[3 * std::size_t{point.triangle}];
  point.position_m = model_.positions_m[first] + point.barycentric[1] * a + point.barycentric[2] * b;
  const ModelSurface::Shading shading = surface_.at({point.triangle, point.barycentric, 0}, material_);
  point.normal = a.cross(b).stableNormalized();
  if (point.normal.dot(shading.interpolated) < 0) point.normal = -point.normal;
  point.emission = shading.opacity * shading.material.emission;
  point.clearcoat = shading.material.clearcoat;
  return point;
}

}  // namespace lumigraft::relight
