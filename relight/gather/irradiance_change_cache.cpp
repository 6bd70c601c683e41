#include "relight/gather/irradiance_change_cache.h"

#include <algorithm>
#include <cmath>

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr float kFinest = 8;  // cells along the radius of the objects' sphere
constexpr int kMostLevels = 12;
constexpr int kCoarser = 3;  // levels, where patches lie farther apart than cells, as on what was guessed of a room

}  // namespace

std::uint64_t IrradianceChangeCache::key(const Vector3f& p_m, const Vector3f& normal, int coarser) const {
  const float far = std::max((p_m - sphere_.centre_m).norm() / sphere_.radius_m - 1, 0.0f);
  const int level = std::clamp(static_cast<int>(std::log2(1 + far)), 0, kMostLevels) + coarser;
  const float edge_m = std::ldexp(sphere_.radius_m / kFinest, level);
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  std::uint64_t key = static_cast<std::uint64_t>(level) * 6 + static_cast<std::uint64_t>(2 * axis) + (normal[axis] < 0);
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::int64_t>(std::floor((p_m[i] - sphere_.centre_m[i]) / edge_m)) + (1 << 17);
    key = key << 18 | static_cast<std::uint64_t>(at & 0x3ffff);
  }
  return key;
}

IrradianceChangeCache::IrradianceChangeCache(const std::vector<Patch>& patches, const BoundingSphere& sphere,
                                             const RayObjects& objects)
    : sphere_(sphere) {
  const auto inside = [&](const Patch& patch) {
    if ((patch.position_m - sphere.centre_m).squaredNorm() > sphere.radius_m * sphere.radius_m) return false;
    return objects.is_inside(patch.position_m, patch.normal);
  };
  for (const Patch& patch : patches) {
    const std::uint64_t at = key(patch.position_m, patch.normal, 0);
    if (found_.contains(at) || inside(patch)) continue;
    found_.emplace(at, static_cast<int>(cells_.size()));
    cells_.push_back(patch);
  }
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    for (int coarser = 1; coarser <= kCoarser; ++coarser) {
      found_.emplace(key(cells_[i].position_m, cells_[i].normal, coarser), static_cast<int>(i));
    }
  }
  irradiance.assign(cells_.size(), Rgb::Zero());
}

void IrradianceChangeCache::reuse_from(const IrradianceChangeCache& others) {
  for (std::size_t i = 0; i < cells_.size(); ++i) irradiance[i] = others.at(cells_[i].position_m, cells_[i].normal);
}

Rgb IrradianceChangeCache::at(const Vector3f& p_m, const Vector3f& normal) const {
  for (int coarser = 0; coarser <= kCoarser; ++coarser) {
    const auto found = found_.find(key(p_m, normal, coarser));
    if (found != found_.end()) return irradiance[static_cast<std::size_t>(found->second)];
  }
  return Rgb::Zero();
}

}  // namespace lumigraft::relight
