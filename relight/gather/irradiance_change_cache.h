#pragma once
// The change of indirect light on real surfaces, in cells that grow with the distance from the objects; what later
// bounces look up.
#include <array>
#include <memory>
#include <vector>

#include "relight/gather/cell_table.h"
#include "relight/gather/ray_objects.h"
#include "relight/gather/ray_room.h"
#include "relight/objects/placement.h"

namespace lumigraft::relight {

class IrradianceChangeCache {
 public:
  /// `sphere`: around the objects. Patches inside of closed objects stand for nothing.
  IrradianceChangeCache(const std::vector<Patch>& patches, const BoundingSphere& sphere, const RayObjects& objects);

  const std::vector<Patch>& cells() const { return layout_->cells; }
  std::vector<Rgb> irradiance;  ///< by cell, signed change without what lamps bring themselves, W/m²

  /// What others held at the same places.
  void reuse_from(const IrradianceChangeCache& others);

  Rgb at(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal) const;

 private:
  static constexpr int kMostLevels = 12;
  static constexpr int kCoarser = 3;  ///< levels more, where patches lie farther apart than cells

  /// Which cell a place belongs to; shared by copies.
  struct Layout {
    BoundingSphere sphere;
    std::array<float, kMostLevels + kCoarser + 1> edge_m;  ///< by level
    std::vector<Patch> cells;
    CellTable found;

    int level(const Eigen::Vector3f& p_m) const;
    std::uint64_t key(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal, int level) const;
  };

  std::shared_ptr<const Layout> layout_;
};

}  // namespace lumigraft::relight
