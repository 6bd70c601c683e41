#pragma once
// How moved surfaces (moved_surfaces.h) change what the fused room hides from lamps: they hide, too, and fused surface
// that this frame's camera sees through is gone, as is surface where something moved a moment ago and that this frame
// does not show. What fusion holds of what has arrived is replaced by this frame's depth.
#include <Eigen/Geometry>
#include <memory>
#include <optional>

#include "relight/gather/moved_surfaces.h"
#include "relight/gather/recently_moved.h"

namespace lumigraft::relight {

class MovedOccluders {
 public:
  /// `moved`: this frame's; `fused`: the room's pixels that they replace, in the same order. They end before the
  /// `objects`. `arrived`: until this frame.
  MovedOccluders(const CameraRays& eye, const CurrentDepth& depth, const MovedPixels& moved, const MovedPixels& fused,
                 const Meshes& objects, ArrivedSurface arrived);

  /// Whether a ray from `from_m` along `w` (unit) is blocked before `limit_m`, tag frame; `by_room`: whether the fused
  /// room blocks it.
  bool blocked(const Meshes& room, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m,
               bool by_room) const;
  /// Likewise, bit masks of the rays of a fan.
  std::uint32_t blocked(const Meshes& room, const RayFan& fan, std::uint32_t by_room) const;

 private:
  bool passes_gone(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m) const;
  bool remains(const Meshes& room, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m) const;

  std::unique_ptr<Meshes> surfaces_;  ///< of this frame's depth; null: none
  Eigen::AlignedBox3f gone_box_;      ///< encloses fused surface that is gone; empty: none is
  std::optional<GoneSpace> gone_;     ///< if any is
};

}  // namespace lumigraft::relight
