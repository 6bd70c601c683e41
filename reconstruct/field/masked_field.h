#pragma once
// A distance field without some of its surfaces.
#include <bitset>
#include <cstdint>
#include <memory>
#include <unordered_map>

#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

/// Voxels that become unknown, by brick, of the field and of its coarse field.
struct SurfaceMask {
  using Voxels = std::unordered_map<BrickKey, std::bitset<kBrickVoxels>, BrickKeyHash>;
  Voxels fine, coarse;

  bool empty() const { return fine.empty() && coarse.empty(); }
  void add(const SurfaceMask& other);
  bool operator==(const SurfaceMask&) const = default;
};

/// Applies masks to each new field. Unchanged bricks stay the same pointers; each new mask has its own
/// occluders_version.
class MaskedField {
 public:
  /// `field` itself if there is no mask.
  std::shared_ptr<const DistanceField> without(const std::shared_ptr<const DistanceField>& field,
                                               const std::shared_ptr<const SurfaceMask>& mask);

 private:
  struct Masked {
    std::shared_ptr<const FieldBrick> before, after;
  };
  using Cache = std::unordered_map<BrickKey, Masked, BrickKeyHash>;
  static void apply(DistanceField& field, const SurfaceMask::Voxels& voxels, Cache& cache);

  Cache fine_, coarse_;
  std::shared_ptr<const DistanceField> field_, result_;
  std::shared_ptr<const SurfaceMask> mask_;
  std::uint64_t version_ = 0;
};

}  // namespace lumigraft::reconstruct
