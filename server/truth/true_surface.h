#pragma once
// The true surfaces of a session's room, in the camera's view or not.
#include <filesystem>
#include <memory>
#include <vector>

#include "reconstruct/room/enclosure.h"
#include "relight/exhibit/exhibit.h"
#include "relight/objects/closest_point.h"

namespace lumigraft::server {

class TrueSurface {
 public:
  /// Loads truth/real_scene.ply. Throws InputError.
  explicit TrueSurface(const std::filesystem::path& real_scene_ply);

  /// Surface points visible from `eye_m`, each for about the same area, in a fixed order. A floor that continues behind
  /// a wall does not count as part of the room.
  std::vector<reconstruct::RoomPoint> seen_from(const Eigen::Vector3f& eye_m) const;
  /// Whether a ray in a unit direction hits the surface.
  bool hides(const Eigen::Vector3f& eye_m, const Eigen::Vector3f& direction) const;

 private:
  std::shared_ptr<const relight::Model> model_;
  relight::ObjectSurface triangles_;
  std::vector<reconstruct::RoomPoint> points_;
};

}  // namespace lumigraft::server
