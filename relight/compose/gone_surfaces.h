#pragma once
// Fused surface that this frame's camera sees through, for methods whose shadows are those of the distance field: a
// hand that was fused while it rested occludes lamps no more when it has left.
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <unordered_map>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "relight/passes/volume/gone_cells.h"

namespace lumigraft::relight {

class GoneSurfaces {
 public:
  using Of = std::function<bool(const Eigen::Vector3f& p_m)>;  ///< a point, tag frame

  /// Cells with surface of `field`, or with what is behind it, that `is_gone`. Of bricks most of whose surface is:
  /// noise shows a little of any surface as gone. `may_matter`: called for one point of each brick. `min_cell_m`: edge
  /// of cells.
  GoneGrid find(const reconstruct::DistanceField& field, const Of& is_gone, float min_cell_m, const Of& may_matter);

 private:
  /// Points on a brick's surface, kept as bricks are immutable.
  struct Surface {
    std::shared_ptr<const reconstruct::FieldBrick> brick;
    std::vector<Eigen::Vector3f> points_m;
    std::uint64_t used = 0;
  };
  std::unordered_map<reconstruct::BrickKey, Surface, reconstruct::BrickKeyHash> surfaces_;
  float voxel_m_ = 0;
  std::uint64_t calls_ = 0;
};

}  // namespace lumigraft::relight
