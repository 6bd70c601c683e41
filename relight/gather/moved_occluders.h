#pragma once
// How moved surfaces (moved_surfaces.h) change what the fused room hides from lamps: they hide, too, and fused surface
// that this frame's camera sees through is gone.
#include <Eigen/Geometry>
#include <memory>

#include "relight/gather/moved_surfaces.h"

namespace lumigraft::relight {

class MovedOccluders {
 public:
  /// `moved`: this frame's; `fused`: the room's pixels that they replace, in the same order. They end before the
  /// `objects`.
  MovedOccluders(const CameraRays& eye, const CurrentDepth& depth, const MovedPixels& moved, const MovedPixels& fused,
                 const Meshes& objects);

  /// Whether a ray from `from_m` along `w` (unit) is blocked before `limit_m`, tag frame; `by_room`: whether the fused
  /// room blocks it.
  bool blocked(const Meshes& room, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m,
               bool by_room) const;
  /// Likewise, bit masks of the rays of a fan.
  std::uint32_t blocked(const Meshes& room, const RayFan& fan, std::uint32_t by_room) const;

 private:
  bool passes_gone(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m) const;
  bool remains(const Meshes& room, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m) const;
  bool seen_through(const Eigen::Vector3f& p_m) const;

  PosedCamera camera_;
  std::unique_ptr<Meshes> surfaces_;  ///< of this frame's depth; null: none
  Eigen::AlignedBox3f gone_;          ///< encloses fused surface that is gone; empty: none is
  capture::Image<float> free_z_m_;    ///< if any is gone: up to this depth along z nothing is there; 0: unknown
};

}  // namespace lumigraft::relight
