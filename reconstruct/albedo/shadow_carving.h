#pragma once
// What throws the shadows that no known surface explains: shadow carving (Savarese, Andreetto, Rushmeier, Bernardini
// and Perona 2007) in the space that surfaces hid from all cameras.
#include <memory>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/light/light.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// A lamp, and of each sample whether its light arrives there.
struct ObservedShadow {
  enum class State : char { unknown, lit, dark };  ///< dark: and no known surface explains it
  const PointLight& lamp;
  std::vector<State> samples;
};

/// Solid voxels in hidden space: the line from a lamp through the voxel ends at a sample that is dark for that lamp,
/// and no line from a lamp through it ends at one that is lit. Voxels of the same brick whose lines end on nothing
/// known are solid, too. Bricks on the field's grid, without colour: -0.5 voxels in solid ones, around them the
/// distance to these, unknown (weight 0) beyond the truncation distance.
BrickMap<FieldBrick> carve_occluders(const DistanceField& field, const FieldRays& rays,
                                     const std::vector<SurfaceSample>& samples,
                                     const std::vector<ObservedShadow>& shadows);

/// Merges such bricks into each new field: the nearer of both distances where it is known, else only solid voxels and
/// those next to them. Unchanged bricks stay the same pointers; each new set of occluders has its own
/// occluders_version.
class OccluderMerge {
 public:
  /// `field` itself where there are no occluders.
  std::shared_ptr<const DistanceField> merged(const std::shared_ptr<const DistanceField>& field,
                                              const std::shared_ptr<const BrickMap<FieldBrick>>& occluders);

 private:
  struct Merged {
    std::shared_ptr<const FieldBrick> field, occluder, result;
  };
  std::unordered_map<BrickKey, Merged, BrickKeyHash> cache_;
  std::shared_ptr<const DistanceField> field_, result_;
  std::shared_ptr<const BrickMap<FieldBrick>> occluders_;
  std::uint64_t occluders_version_ = 0;
};

}  // namespace lumigraft::reconstruct
