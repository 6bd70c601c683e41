#pragma once
// The true real surfaces of a session, seen by its camera or not.
#include <filesystem>
#include <memory>
#include <vector>

#include "reconstruct/room/enclosure.h"
#include "relight/exhibit/exhibit.h"
#include "relight/objects/closest_point.h"

namespace lumigraft {

class TrueSurface {
 public:
  /// Of truth/real_scene.ply. Throws InputError.
  explicit TrueSurface(const std::filesystem::path& real_scene_ply);

  /// Points of it, each for about the same area, in a fixed order: those that a place sees. A floor that goes on behind
  /// a wall is not of the room.
  std::vector<RoomPoint> seen_from(const Eigen::Vector3f& eye_m) const;

 private:
  std::shared_ptr<const Model> model_;
  ObjectSurface triangles_;
  std::vector<RoomPoint> points_;
};

}  // namespace lumigraft
