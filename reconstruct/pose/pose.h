#pragma once
// Camera pose from AprilTags, or from depth against the room's surface while they are hidden.
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/response.h"
#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/keyframe_map.h"
#include "reconstruct/pose/parameters.h"
#include "reconstruct/pose/tag_map.h"

namespace lumigraft::reconstruct {

struct Pose {
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();      ///< filtered over time; used for rendering
  Eigen::Isometry3d T_tag_camera_raw = Eigen::Isometry3d::Identity();  ///< of this frame alone
  double reprojection_error_px = 0;                                    ///< RMS over the four corners
  /// Blur of lens, motion and pixel at the tags: edge of the box with the same second moment. 1: a pixel's area alone;
  /// 0: no print was measured in this frame.
  double blur_px = 0;
  PoseCovariance covariance = PoseCovariance::Zero();  ///< of T_tag_camera
  /// Of the frame in which the exhibit is placed: the first tag's original place, or where it is now
  /// (Tag::moves_exhibit).
  Eigen::Isometry3d T_tag_exhibit = Eigen::Isometry3d::Identity();
  enum class From { tag, surface, past } from = From::tag;  ///< past: an older pose, nothing was seen
  std::int64_t time_ns = 0;                                 ///< device time of the measurement
  std::int64_t age_ns = 0;                                  ///< since a tag was last seen; 0 if in this frame
};

/// Detects the tag, aligns both poses that explain its corners (Schweighofer & Pinz 2006) to the whole print, and
/// chooses by the fit of corners and print, the distance to the last pose, and the plane that depth measures inside the
/// tag. Depth never moves the pose, since its errors at the tag's distance are larger than those of the print. Clipped
/// paper does not move it either; a warning says if too few edges are left. While all tags are hidden and a field is
/// given, the camera is tracked by depth; when a tag reappears, the difference fades out within some frames.
/// Where the camera's readout time is known, the pose is that of the time at which the row of the tags' centre was
/// exposed (rolling_shutter.h); else its covariance grows with the motion.
class PoseStage {
 public:
  /// `response` linearises encoded images. `readout_s`: of the colour camera, from its first row to its last one;
  /// empty: as each frame says. Throws InputError for a family or id that does not exist.
  PoseStage(const capture::Tag& tag, const capture::CameraModel& color,
            const capture::Response& response = capture::Response::srgb(), const capture::DepthNoise& noise = {},
            const std::optional<double>& readout_s = std::nullopt);
  ~PoseStage();

  /// How long a pose may be used after anything was last seen.
  static constexpr std::int64_t kAgeLimitNs = kPose.age_limit_ns;

  struct Result {
    std::optional<Pose> pose;  ///< empty: unknown, and the last one is older than kAgeLimitNs
    std::vector<std::string> warnings;
  };
  /// `field`: the room's known surface; may be null.
  Result locate(const capture::FrameSet& frame, const DistanceField* field = nullptr);
  void reset();  ///< forgets the past, e.g. if a recording restarts

  /// Goes on from a tag map that was learnt before (read_tag_map), from the next frame on.
  void restore_tag_map(TagMap::State learnt);
  /// Goes on from views that were kept before (read_views). They are dropped if a tag shows that they are of another
  /// room, or that it was moved since. Without a tag they define the world.
  void restore_views(KeyframeMap::Views views);
  /// The kept views if some were added since the last call.
  std::optional<KeyframeMap::Views> take_views();
  /// The map of several tags if it changed since the last call.
  std::optional<TagMap::State> take_tag_map();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
