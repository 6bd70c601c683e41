#pragma once
// Enclosure of the room: a convex hull of a few planes around everything known. Depth images show a part of a room;
// this closes the rest, so that every ray from an object hits a surface.
//
// Planes with much known surface, and none behind them, are measured sides and are extended beyond what was seen. A
// panel that emits away from the end of the known surface is assumed to be mounted in a side. Towards the remaining
// ends a side is guessed half as far again from the fish-eye as anything known. Its radiance is what the fish-eye saw
// in that direction; the guess decides only how strongly near objects light it.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

constexpr std::size_t kMaxSides = 12;  ///< as in the shaders

struct Enclosure {
  struct Side {
    Eigen::Vector3f normal;  ///< unit, inwards; tag frame
    float offset_m = 0;      ///< n·p + offset is 0 on the side, positive inside
    bool measured = false;   ///< else guessed
  };
  std::vector<Side> sides;                             ///< measured ones first; at most kMaxSides
  Eigen::Vector3f middle_m = Eigen::Vector3f::Zero();  ///< about the centre

  /// Distance and side at which a ray from inside along a unit direction leaves; empty if no side is ahead.
  struct Exit {
    float distance_m;
    std::size_t side;
  };
  std::optional<Exit> leave(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction) const;
};

struct RoomPoint {
  Eigen::Vector3f position_m, normal;  ///< tag frame; the normal towards free space
};

/// Points of the field's surface, at most one per cube of 4³ voxels, in a fixed order.
std::vector<RoomPoint> room_points(const DistanceField& field);

/// `points` represent equal areas. The fish-eye, lamps at known distances and `inside_m` are also inside. Empty if too
/// little is known for a single side.
std::optional<Enclosure> close_room(const std::vector<RoomPoint>& points, const Illumination& light,
                                    const std::vector<Eigen::Vector3f>& inside_m);

/// Keeps the enclosure while the reconstruction grows.
class EnclosureStage {
 public:
  /// The same pointer as before while no side moves by more than noise. Null if too little is known.
  /// `points`: room_points(field).
  std::shared_ptr<const Enclosure> close(const DistanceField& field, const std::vector<RoomPoint>& points,
                                         const Illumination& light);

 private:
  std::shared_ptr<const Enclosure> last_;
};

}  // namespace lumigraft::reconstruct
