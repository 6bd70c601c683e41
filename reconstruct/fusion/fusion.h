#pragma once
// Depth pictures into the distance field.
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::reconstruct {

struct FusionSettings {
  double voxel_m = 0.008;
  double truncation_voxels = 4.0;
  double far_m = 5.0;      ///< depth beyond it is not fused
  double weight_cap = 64;  ///< how long the past counts
};

/// Projective TSDF update with a sensor noise model: axial noise grows with depth² and with the angle of incidence
/// (Nguyen, Izadi & Lovell 2012, eq. 3), weight = 1/σ². Distances are measured to the plane a pixel sees, not along
/// its ray, so that they hold at grazing views too. Carves free space: what is seen far from where it was, by more than
/// noise explains, leaves the past little weight, so that a visitor is gone within a second. Behind a rim only what
/// stands where the camera sees it is solid; of two sides of something thin, each holds on its own side of it, though
/// to the other camera it is hidden. Colour is fused as radiance, weighted by facing; clipped pixels do not
/// count.
///
/// Real surfaces that the session names are found in depth and laid over what it tells (real_surface.h).
///
/// Bricks that pictures have told much about are looked at less often while the camera stays where it is, and every
/// time while what they show moves. New bricks, and what moved, are published at once; up to four pictures later fewer
/// than 64 new voxels of a known brick (after the first four pictures), and what drifted from what was published by
/// more than noise or 2 % of a voxel, or 1 % of radiance. A room that stands still is a field that stands still, brick
/// by brick: what changed is what is not the same pointer as in the field before.
class FusionStage {
 public:
  FusionStage(const capture::Session& session, const FusionSettings& settings);
  ~FusionStage();
  /// The field with this frame in it, as far as that makes a difference. Unchanged (the same pointer) where the frame
  /// has no depth, where its pose is old, or where neither its pictures nor its pose differ (by more than 10 µm) from
  /// the last one fused. Null until a depth was fused.
  std::shared_ptr<const DistanceField> fuse(const capture::FrameSet& frame, const Pose& pose);
  /// What is wrong with what the session says about real surfaces (see real_surface.h).
  std::vector<std::string> warnings() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
