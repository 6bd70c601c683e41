#pragma once
// Objects that stand on the room (VirtualObject::stands): raised or lowered onto the fused surface below them.
#include <Eigen/Core>
#include <string>
#include <unordered_map>

#include "reconstruct/field/distance_field.h"
#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

class Standing {
 public:
  /// The exhibit, in the tag frame, with its standing objects moved along `up` (unit): the lowest point of each is
  /// level with the median of the surface under its footprint, as far as it was seen, from its own height above its
  /// place to kMaxDrop_m below. Elsewhere it stays at its place. The height is kept until object or surface moves, the
  /// surface by more than half a voxel, so that noise moves no object. `field` may be null.
  Exhibit placed(Exhibit exhibit, const reconstruct::DistanceField* field, const Eigen::Vector3f& up, double time_s);

  static constexpr float kMaxDrop_m = 3;  ///< below a stage or a table of the room

 private:
  struct Held {
    Eigen::Affine3d T_tag_model;  ///< at its place
    const Model* model = nullptr;
    std::uint64_t field_version = 0;
    float raised_m = 0;
  };
  std::unordered_map<std::string, Held> held_;  ///< by name
};

}  // namespace lumigraft::relight
