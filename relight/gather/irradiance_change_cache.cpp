#include "relight/gather/irradiance_change_cache.h"

#include <algorithm>
#include <cmath>

#include "relight/gather/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

}  // namespace

/// Doubles when the distance from the sphere, in radii plus one, doubles.
int IrradianceChangeCache::Layout::level(const Vector3f& p_m) const {
  const float far = std::max((p_m - sphere.centre_m).norm() / sphere.radius_m - 1, 0.0f);
  return std::clamp(static_cast<int>(std::log2(1 + far)), 0, kMaxLevels);
}

std::uint64_t IrradianceChangeCache::Layout::key(const Vector3f& p_m, const Vector3f& normal, int level) const {
  const float edge = edge_m[static_cast<std::size_t>(level)];
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  std::uint64_t key = static_cast<std::uint64_t>(level) * 6 + static_cast<std::uint64_t>(2 * axis) + (normal[axis] < 0);
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::int64_t>(std::floor((p_m[i] - sphere.centre_m[i]) / edge)) + (1 << 17);
    key = key << 18 | static_cast<std::uint64_t>(at & 0x3ffff);
  }
  return key;
}

IrradianceChangeCache::IrradianceChangeCache(const std::vector<Patch>& patches, const BoundingSphere& sphere,
                                             const RayObjects& objects) {
  auto layout = std::make_shared<Layout>();
  layout->sphere = sphere;
  for (std::size_t i = 0; i < layout->edge_m.size(); ++i) {
    layout->edge_m[i] = std::ldexp(sphere.radius_m / kGather.cells_across, static_cast<int>(i));
  }
  std::vector<std::uint64_t> keys(patches.size());
  for_each_index(patches.size(), kGather.patch_block, [&](std::size_t i) {
    keys[i] = layout->key(patches[i].position_m, patches[i].normal, layout->level(patches[i].position_m));
  });
  const auto inside = [&](const Patch& patch) {
    if ((patch.position_m - sphere.centre_m).squaredNorm() > sphere.radius_m * sphere.radius_m) return false;
    return objects.is_inside(patch.position_m, patch.normal);
  };
  std::vector<Patch>& cells = layout->cells;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (layout->found.find(keys[i]) >= 0 || inside(patches[i])) continue;
    layout->found.insert(keys[i], static_cast<int>(cells.size()));
    cells.push_back(patches[i]);
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const int level = layout->level(cells[i].position_m);
    for (int coarser = 1; coarser <= kCoarser; ++coarser) {
      layout->found.insert(layout->key(cells[i].position_m, cells[i].normal, level + coarser), static_cast<int>(i));
    }
  }
  irradiance.assign(cells.size(), Rgb::Zero());
  layout_ = std::move(layout);
}

void IrradianceChangeCache::reuse_from(const IrradianceChangeCache& others) {
  const std::vector<Patch>& all = cells();
  for (std::size_t i = 0; i < all.size(); ++i) irradiance[i] = others.at(all[i].position_m, all[i].normal);
}

int IrradianceChangeCache::cell_at(const Vector3f& p_m, const Vector3f& normal) const {
  const int level = layout_->level(p_m);
  for (int coarser = 0; coarser <= kCoarser; ++coarser) {
    const int found = layout_->found.find(layout_->key(p_m, normal, level + coarser));
    if (found >= 0) return found;
  }
  return -1;
}

}  // namespace lumigraft::relight
