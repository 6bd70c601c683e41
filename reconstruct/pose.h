#pragma once
// Where the camera stands, from one AprilTag.
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session.h"

namespace lumigraft {

struct Pose {
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();      ///< smoothed over time; what pictures use
  Eigen::Isometry3d T_tag_camera_raw = Eigen::Isometry3d::Identity();  ///< this measurement alone
  double reprojection_error_px = 0;  ///< RMS over the four corners
  std::int64_t time_ns = 0;          ///< device time of the measurement
  std::int64_t age_ns = 0;           ///< 0 when the tag was seen in this very frame
};

/// Finds the tag, considers both poses that explain it (Schweighofer & Pinz 2006), chooses by reprojection error,
/// nearness to the last pose, and the plane that depth shows where the tag lies. Smooths; keeps the raw pose.
class PoseStage {
 public:
  PoseStage(const Tag& tag, const CameraModel& color);
  ~PoseStage();

  struct Result {
    std::optional<Pose> pose;  ///< empty: no tag now, and the last pose is older than its age limit
    std::vector<std::string> warnings;
  };
  Result locate(const FrameSet& frame);
  void reset();  ///< forgets the past (a recording starts again)

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft
