#pragma once
// Fusion of depth images at one size of voxels.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/fusion/brick_selection.h"
#include "reconstruct/fusion/fusion_memory.h"
#include "reconstruct/fusion/parameters.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::reconstruct {

/// What of the images a level fuses.
struct FusionScope {
  DepthRange surface_m;            ///< depth of surfaces for which bricks are created
  float depth_to_m = 0;            ///< depth up to which bricks are updated, also those that it shows to be free
  std::size_t max_bricks = 0;      ///< updated in one frame
  bool first_frame_whole = false;  ///< the first frame updates all
  bool with_viewpoints = false;    ///< the field lists the viewpoints and what they saw
};

/// A distance field with one size of voxels (FusionStage says how it is fused).
class FusionLevel {
 public:
  FusionLevel(const capture::Session& session, const FusionSettings& settings, const FusionScope& scope);
  ~FusionLevel();
  /// As FusionStage::fuse.
  std::shared_ptr<const DistanceField> fuse(
      const capture::FrameSet& frame, const Pose& pose, double light_change,
      const std::function<Eigen::Array3f(const Eigen::Vector3f& position_m)>& light_ratio);
  /// As FusionStage::restore, of one size of voxels.
  void restore(BrickMap<FieldBrick> kept);
  /// In place of that of the settings.
  void set_max_memory(double mb);
  FusionMemory memory() const;
  std::vector<std::string> warnings() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
