#pragma once
// Where fused surface is not there now: this frame's camera sees through it, or something moved there a moment ago that
// this frame does not show, or it is what fusion holds of something that just came, which this frame's depth replaces.
#include <Eigen/Geometry>

#include "capture/image.h"
#include "relight/compose/free_space.h"
#include "relight/gather/recently_moved.h"

namespace lumigraft::relight {

class GoneSpace {
 public:
  /// `camera`: whose pixels `depth` has; it must have some. `arrived`: until this frame.
  GoneSpace(const PosedCamera& camera, const CurrentDepth& depth, ArrivedSurface arrived);

  /// Of a point on fused surface, tag frame.
  bool contains(const Eigen::Vector3f& p_m) const;
  /// Encloses where something moved a moment ago; empty: nothing did.
  const Eigen::AlignedBox3f& recent_box() const { return arrived_.recent().box(); }

 private:
  ArrivedSurface arrived_;
  FreeSpace free_;
  /// Nothing is nearer than the first of these depths along z, and nothing behind the second is seen; 0: unknown.
  capture::Image<float> free_z_m_, hidden_z_m_;
};

}  // namespace lumigraft::relight
