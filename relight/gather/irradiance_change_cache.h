#pragma once
// Cache of the change of indirect irradiance on real surfaces, in cells whose size grows with the distance from the
// objects; the source of later bounces.
#include <array>
#include <memory>
#include <vector>

#include "reconstruct/math/cell_table.h"
#include "relight/gather/ray_objects.h"
#include "relight/gather/ray_room.h"
#include "relight/objects/placement.h"

namespace lumigraft::relight {

class IrradianceChangeCache {
 public:
  /// `sphere`: around the objects. Patches inside closed objects are ignored.
  IrradianceChangeCache(const std::vector<Patch>& patches, const BoundingSphere& sphere, const RayObjects& objects);

  const std::vector<Patch>& cells() const { return layout_->cells; }
  /// Per cell, signed change without the lamps' direct light, with that of objects that emit, W/m².
  std::vector<Rgb> irradiance;

  /// Copies the values of another cache at the same positions.
  void reuse_from(const IrradianceChangeCache& others);

  /// Index of the cell that represents a point; -1: none.
  int cell_at(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal) const;
  Rgb at(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal) const {
    const int cell = cell_at(p_m, normal);
    return cell < 0 ? Rgb::Zero() : irradiance[static_cast<std::size_t>(cell)];
  }

 private:
  static constexpr int kMaxLevels = 12;
  static constexpr int kCoarser = 3;  ///< additional levels, for patches farther apart than the cells

  /// Assignment of positions to cells; shared by copies.
  struct Layout {
    BoundingSphere sphere;
    std::array<float, kMaxLevels + kCoarser + 1> edge_m;  ///< per level
    std::vector<Patch> cells;
    reconstruct::CellTable found;

    int level(const Eigen::Vector3f& p_m) const;
    std::uint64_t key(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal, int level) const;
  };

  std::shared_ptr<const Layout> layout_;
};

}  // namespace lumigraft::relight
