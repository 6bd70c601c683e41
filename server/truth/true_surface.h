#pragma once
// The true real surfaces of a session, seen by its camera or not.
#include <filesystem>
#include <memory>
#include <vector>

#include "reconstruct/room/enclosure.h"
#include "relight/exhibit/exhibit.h"
#include "relight/objects/closest_point.h"

namespace lumigraft::server {

class TrueSurface {
 public:
  /// Of truth/real_scene.ply. Throws InputError.
  explicit TrueSurface(const std::filesystem::path& real_scene_ply);

  /// Points of it, each for about the same area, in a fixed order: those that a place sees. A floor that goes on behind
  /// a wall is not of the room.
  std::vector<reconstruct::RoomPoint> seen_from(const Eigen::Vector3f& eye_m) const;
  /// Whether it lies along a unit direction.
  bool hides(const Eigen::Vector3f& eye_m, const Eigen::Vector3f& direction) const;

 private:
  std::shared_ptr<const relight::Model> model_;
  relight::ObjectSurface triangles_;
  std::vector<reconstruct::RoomPoint> points_;
};

}  // namespace lumigraft::server
