#pragma once
// Fusion of depth images into the distance field.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/fusion/fusion_memory.h"
#include "reconstruct/fusion/parameters.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::reconstruct {

/// Projective TSDF update (Curless & Levoy 1996) with weights 1/σ² from a sensor noise model: axial noise grows with
/// depth² and with the angle of incidence (Nguyen, Izadi & Lovell 2012, eq. 3). Distances are to the plane that a pixel
/// observes, not along its ray, so that they are right at grazing angles too. Carves free space: where a measurement
/// differs from the past by more than noise explains, the past loses its weight, so that a visitor disappears within a
/// second. Behind a rim only voxels at a visible surface are solid. Of two sides of a thin object each keeps its own
/// voxels, although it is hidden from the other side. Colour is fused as radiance, weighted by the cosine of incidence;
/// clipped pixels do not count.
///
/// Surfaces beyond FusionSettings::far_m are fused in coarser voxels, up to 12 m, into DistanceField::coarse
/// (CoarseParameters). Both levels share the memory.
///
/// Real surfaces that the session names are registered in depth and merged into the field (real_surface.h).
///
/// A brick is updated as often as that adds information, and in every frame while its content moves; the work of one
/// frame is bounded (UpdateSchedule), and so is the memory: bricks that were not seen for long, far from the tag, are
/// evicted, and fused again when they are seen again. New bricks and moved content are published at once, smaller
/// changes up to four frames later (PublicationParameters). A brick that did not change is the same pointer as in the
/// previous field.
class FusionStage {
 public:
  FusionStage(const capture::Session& session, const FusionSettings& settings);
  ~FusionStage();
  /// Fuses a frame and returns the published field. The same pointer as before if nothing is published. A frame
  /// with the images and the pose (within 1e-5 m and per matrix element) of the last fused one only updates the bricks
  /// for which that had no time (UpdateSchedule::max_bricks). A frame without depth, or whose
  /// pose was not measured in it, only updates radiance to the changed light. Null before the first depth image.
  /// `light_change`: relative change of the room's light since the previous call (relative_change of light.h).
  /// It is added, squared, to the relative variance of the radiance of earlier frames.
  /// `light_ratio`: irradiance at a place now over that at the previous call, per channel; earlier radiance is
  /// multiplied by it, and less certain by its logarithm. Empty: it keeps what it had.
  std::shared_ptr<const DistanceField> fuse(
      const capture::FrameSet& frame, const Pose& pose, double light_change = 0,
      const std::function<Eigen::Array3f(const Eigen::Vector3f& position_m)>& light_ratio = {});
  /// Adds surfaces as they were known in an earlier run, with the voxels of these settings; radiance is not used. Where
  /// this run has observed something, that stays. What does not fit into the memory, far from the tag, is left out. The
  /// next `fuse` publishes it.
  void restore(DistanceField kept);
  using Memory = FusionMemory;
  Memory memory() const;
  /// Real surfaces of the session that depth contradicts (real_surface.h).
  std::vector<std::string> warnings() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
