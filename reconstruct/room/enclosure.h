#pragma once
// What closes the room where no camera has looked: a convex hull of a few planes around everything known. Depth
// pictures show a part of a room; light that an object takes or gives leaves it through the rest and comes back.
//
// Planes that hold much of the known surface, and have none of it behind them, are sides of the room, and go on where
// they were not seen. A lamp that shines straight away from the end of what is known is taken to be set into a side.
// Towards the other ends a side is guessed half as far again from the fish-eye as anything known. What light comes from
// there the fish-eye saw, wherever the side is; the guess only says how strongly it is lit by what is near.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

constexpr std::size_t kMostSides = 12;

struct Enclosure {
  struct Side {
    Eigen::Vector3f normal;  ///< unit, to the inside; tag frame
    float offset_m = 0;      ///< n·p + offset is 0 on the side, positive inside
    bool measured = false;   ///< else guessed
  };
  std::vector<Side> sides;                             ///< those that were measured first; at most kMostSides
  Eigen::Vector3f middle_m = Eigen::Vector3f::Zero();  ///< well inside

  /// Where a ray from inside along a unit direction leaves, and through which side; empty where none is ahead.
  struct Exit {
    float distance_m;
    std::size_t side;
  };
  std::optional<Exit> leave(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction) const;
};

struct RoomPoint {
  Eigen::Vector3f position_m, normal;  ///< the normal to free space
};

/// Points of the field's surface, one for each four voxels or so, in a fixed order.
std::vector<RoomPoint> room_points(const DistanceField& field);

/// `points` stand for equal areas. Inside lie also the fish-eye and lamps at known distances, and `inside_m`. Empty
/// where too little is known for a single side.
std::optional<Enclosure> close_room(const std::vector<RoomPoint>& points, const Illumination& light,
                                    const std::vector<Eigen::Vector3f>& inside_m);

/// The same for the room as it is learnt.
class EnclosureStage {
 public:
  /// The same pointer again while the sides stay where they were, but for noise. Null where nothing closes the room.
  std::shared_ptr<const Enclosure> close(const DistanceField& field, const Illumination& light);
  /// The same, where the field's room_points are at hand.
  std::shared_ptr<const Enclosure> close(const DistanceField& field, const std::vector<RoomPoint>& points,
                                         const Illumination& light);

 private:
  std::shared_ptr<const Enclosure> last_;
};

}  // namespace lumigraft::reconstruct
