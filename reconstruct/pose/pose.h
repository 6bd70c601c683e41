#pragma once
// Where the camera stands: from an AprilTag, and while that is hidden from the room's surface.
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

namespace lumigraft::reconstruct {

struct Pose {
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();      ///< smoothed over time; what pictures use
  Eigen::Isometry3d T_tag_camera_raw = Eigen::Isometry3d::Identity();  ///< this measurement alone
  double reprojection_error_px = 0;                                    ///< RMS over the four corners
  PoseCovariance covariance = PoseCovariance::Zero();                  ///< of T_tag_camera
  enum class From { tag, surface, past } from = From::tag;             ///< past: an old pose, for nothing was seen
  std::int64_t time_ns = 0;                                            ///< device time of the measurement
  std::int64_t age_ns = 0;  ///< since the tag was last seen; 0 when it was in this very frame
};

/// Finds the tag, considers both poses that explain it (Schweighofer & Pinz 2006), refines each on the whole print,
/// chooses by how well corners and print fit, nearness to the last pose, and the plane that depth shows where the tag
/// lies. Paper that is cut off at the picture's end moves nothing; a warning says where too little of its edges is left
/// to be sure. Smooths; keeps the raw pose. Depth only chooses, it never moves the pose: depth cameras err by more at
/// the tag's distance than the print does. While the tag is hidden and a field is given, depth on the room's surface
/// carries the pose on; when the tag comes back, what that was off by fades within some frames.
class PoseStage {
 public:
  /// `response` linearises encoded pictures. Throws InputError for a tag that does not exist.
  PoseStage(const capture::Tag& tag, const capture::CameraModel& color,
            const capture::Response& response = capture::Response::srgb());
  ~PoseStage();

  /// How long a pose may be used after anything was last seen.
  static constexpr std::int64_t kAgeLimitNs = 500'000'000;

  struct Result {
    std::optional<Pose> pose;  ///< empty: nothing holds it now, and the last pose is older than its limit
    std::vector<std::string> warnings;
  };
  /// `field`: the room's surface as far as it is known; may be null.
  Result locate(const capture::FrameSet& frame, const DistanceField* field = nullptr);
  void reset();  ///< forgets the past (a recording starts again)

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
