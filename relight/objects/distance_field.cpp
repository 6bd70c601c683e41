#include "relight/objects/distance_field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "relight/objects/closest_point.h"
#include "relight/objects/model_surface.h"
#include "relight/objects/nearest_cells.h"
#include "relight/objects/parameters.h"
#include "relight/objects/solid_voxels.h"

namespace lumigraft::relight {
namespace {

constexpr int margin_voxels = 3;
constexpr float band_voxels = 3.0f;
// Half the minimum thickness of any surface. Slightly more than half a voxel, so that a sheet halfway between two
// layers of voxels contains both.
constexpr float half_shell_voxels = 0.51f;
constexpr int block_voxels = 8;

class FieldBuilder {
 public:
  FieldBuilder(const Model& model, int edge_voxels)
      : model_(model), surface_(model), solid_(model), shading_(model, /*mips=*/true) {
    Eigen::AlignedBox3f box;
    for (const std::uint32_t v : model.indices) box.extend(model.positions_m[v]);
    const Eigen::Vector3f extent = box.sizes();
    h_ = extent.maxCoeff() / static_cast<float>(edge_voxels);
    field_.voxel_m = h_;
    for (int a = 0; a < 3; ++a) {
      // The voxels' cells cover the box; the excess is split between both sides.
      const int covering = std::max(1, static_cast<int>(std::ceil(extent[a] / h_ - 1e-3f)));
      field_.size[a] = covering + 2 * margin_voxels;
      field_.origin_m[a] = box.center()[a] - 0.5f * h_ * static_cast<float>(field_.size[a] - 1);
    }
  }

  ObjectField build() {
    inside_ = solid_.inside(field_.size, field_.origin_m, h_);
    field_.distance_m.resize(inside_.size());
    std::transform(inside_.begin(), inside_.end(), field_.distance_m.begin(),
                   [&](std::uint8_t in) { return (in ? -band_voxels : band_voxels) * h_; });
    field_.base_color.assign(inside_.size(), Eigen::Vector3f::Zero());
    field_.metallic.assign(inside_.size(), 0);
    field_.part.assign(inside_.size(), 0);
    for (int k = 0; k < field_.size[2]; k += block_voxels) {
      for (int j = 0; j < field_.size[1]; j += block_voxels) {
        for (int i = 0; i < field_.size[0]; i += block_voxels) visit({i, j, k}, block_voxels);
      }
    }
    return std::move(field_);
  }

 private:
  static constexpr float reach_voxels = band_voxels + half_shell_voxels;

  // Recursion stops at a cube of voxels whose centre is farther from the surface than its half diagonal plus the band.
  void visit(const std::array<int, 3>& corner, int edge) {
    for (int a = 0; a < 3; ++a) {
      if (corner[a] >= field_.size[a]) return;
    }
    const Eigen::Vector3f first = field_.origin_m + h_ * Eigen::Vector3i::Map(corner.data()).cast<float>();
    const float half = 0.5f * static_cast<float>(edge - 1) * h_;
    const float radius = reach_voxels * h_ + std::sqrt(3.0f) * half;
    const auto nearest = surface_.nearest(first + Eigen::Vector3f::Constant(half), radius);
    if (!nearest) return;
    if (edge == 1) {
      set(corner, first, *nearest);
      return;
    }
    const int step = edge / 2;
    for (int n = 0; n < 8; ++n) {
      visit({corner[0] + (n & 1) * step, corner[1] + (n >> 1 & 1) * step, corner[2] + (n >> 2) * step}, step);
    }
  }

  void set(const std::array<int, 3>& at, const Eigen::Vector3f& p, const ClosestPoint& nearest) {
    const std::size_t index = index_of(at[0], at[1], at[2]);
    const float thicker = half_thickening(p, nearest);
    const float distance = inside_[index] ? -(nearest.distance_m + thicker) : nearest.distance_m - thicker;
    field_.distance_m[index] = std::clamp(distance, -band_voxels * h_, band_voxels * h_);
    const Material material = shading_.at({nearest.triangle, nearest.barycentric, h_}, {}).material;
    field_.base_color[index] = material.base_color;
    field_.metallic[index] = material.metallic;
    field_.part[index] = shading_.part(nearest.triangle);
  }

  // Outward offset of the surface at the nearest point, so that nothing is thinner than a shell: half a shell where a
  // part is open, and the missing thickness where the far wall of a solid is nearer than a shell's thickness.
  float half_thickening(const Eigen::Vector3f& p, const ClosestPoint& nearest) const {
    const float half_shell = half_shell_voxels * h_;
    const std::uint32_t component = solid_.component(nearest.triangle);
    if (!solid_.is_solid(component)) return half_shell;

    const Eigen::Vector3f inwards = inwards_at(p, nearest, component);
    const float back = 1e-3f * h_;
    // The ray exits through the far wall. 60° separates it from walls adjacent to a nearest point on an edge.
    const auto far_wall = [&](std::uint32_t triangle, const Eigen::Vector3f& normal) {
      return solid_.component(triangle) == component && solid_.orientation(component) * normal.dot(inwards) > 0.5f;
    };
    const auto hit = surface_.first_hit(nearest.position_m - back * inwards, inwards, 2 * half_shell + back, far_wall);
    return hit ? std::max(0.0f, half_shell - 0.5f * std::max(0.0f, *hit - back)) : 0.0f;
  }

  Eigen::Vector3f inwards_at(const Eigen::Vector3f& p, const ClosestPoint& nearest, std::uint32_t component) const {
    if (nearest.distance_m > 1e-3f * h_) {
      const Eigen::Vector3f away = (p - nearest.position_m) / nearest.distance_m;
      return inside_at(p) ? away : Eigen::Vector3f(-away);
    }
    const std::uint32_t* v = &model_.indices[3 * std::size_t{nearest.triangle}];
    const Eigen::Vector3f& a = model_.positions_m[v[0]];
    return -solid_.orientation(component) *
           (model_.positions_m[v[1]] - a).cross(model_.positions_m[v[2]] - a).stableNormalized();
  }

  bool inside_at(const Eigen::Vector3f& p) const {
    const Eigen::Vector3i at = ((p - field_.origin_m) / h_).array().round().cast<int>();
    return inside_[index_of(at[0], at[1], at[2])] != 0;
  }

  std::size_t index_of(int i, int j, int k) const {
    return i + static_cast<std::size_t>(field_.size[0]) * (j + static_cast<std::size_t>(field_.size[1]) * k);
  }

  const Model& model_;
  ObjectSurface surface_;
  ObjectSolid solid_;
  ModelSurface shading_;
  float h_ = 0;
  ObjectField field_;
  std::vector<std::uint8_t> inside_;
};

}  // namespace

std::shared_ptr<const ObjectField> compute_object_field(const Model& model, int edge_voxels) {
  return std::make_shared<ObjectField>(FieldBuilder(model, edge_voxels).build());
}

std::vector<float> full_distances(const ObjectField& field) {
  std::vector<NearestCell> seeds(field.distance_m.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    if (std::abs(field.distance_m[i]) <= kObjects.seed_voxels * field.voxel_m) seeds[i].point = static_cast<int>(i);
  }
  spread_nearest(seeds, Eigen::Vector3i::Map(field.size.data()));

  std::vector<float> full(seeds.size());
  for (std::size_t i = 0; i < full.size(); ++i) {
    const float near = field.distance_m[i];
    const bool found = seeds[i].point != NearestCell::kNone;
    const float squared = found ? std::min(static_cast<float>(seeds[i].squared), kObjects.max_far2) : kObjects.max_far2;
    const float far = (std::sqrt(squared) - kObjects.seed_voxels) * field.voxel_m;
    full[i] = std::copysign(std::max(std::abs(near), far), near);
    if (std::abs(near) < 2.5f * field.voxel_m) full[i] = near;
  }
  return full;
}

}  // namespace lumigraft::relight
