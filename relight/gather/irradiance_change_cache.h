#pragma once
// The change of indirect light on real surfaces, in cells that grow with the distance from the objects; what later
// bounces look up.
#include <unordered_map>
#include <vector>

#include "relight/gather/ray_objects.h"
#include "relight/gather/ray_room.h"
#include "relight/objects/placement.h"

namespace lumigraft::relight {

class IrradianceChangeCache {
 public:
  /// `sphere`: around the objects. Patches inside of closed objects stand for nothing.
  IrradianceChangeCache(const std::vector<Patch>& patches, const BoundingSphere& sphere, const RayObjects& objects);

  const std::vector<Patch>& cells() const { return cells_; }
  std::vector<Rgb> irradiance;  ///< by cell, signed change without what lamps bring themselves, W/m²

  /// What others held at the same places.
  void reuse_from(const IrradianceChangeCache& others);

  Rgb at(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal) const;

 private:
  /// `coarser`: by how many levels than at this distance from the objects.
  std::uint64_t key(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal, int coarser) const;

  BoundingSphere sphere_;
  std::vector<Patch> cells_;
  std::unordered_map<std::uint64_t, int> found_;
};

}  // namespace lumigraft::relight
