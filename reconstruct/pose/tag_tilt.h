#pragma once
// Corrects the tilt of a tag by the surface on which it lies.
//
// Four corners a hand wide determine a tag's tilt badly: half a pixel of error, by bent paper or by a lens that is not
// calibrated where it is seen, is some degrees, and the camera is then displaced by centimetres. Depth measures the
// surface around the tag, whose normal is known to a fraction of a degree, whatever the depth's scale.
#include <Eigen/Core>
#include <optional>
#include <string>

#include "reconstruct/pose/depth_plane.h"
#include "reconstruct/pose/tag_pose_estimator.h"

namespace lumigraft::reconstruct {

/// Of one tag. The size of its print's bias is unknown; a prior over it (TagTiltParameters) is updated by the
/// difference of both normals. A print that agrees with depth within depth's errors keeps its pose and its covariance;
/// one that does not is turned to the surface, as far as its bias explains the difference. Residuals of the corners are
/// no evidence: the detector displaces corners of exact prints by a quarter of a pixel, too.
class TagTilt {
 public:
  /// `focal_px`: of the colour camera.
  TagTilt(double size_m, double focal_px) : size_m_(size_m), focal_px_(focal_px) {}

  /// Corrects a candidate by this frame's plane, or without one by the mean of earlier differences. The candidate's
  /// bias becomes what remains.
  void correct(PoseCandidate& candidate, const std::optional<SurroundingPlane>& plane) const;
  /// Takes the difference of a candidate that was chosen.
  void add(const PoseCandidate& candidate);
  /// Empty unless depth contradicts the print in several frames in a row.
  std::string warning(int id) const;
  /// Where the print appears if the tag is at `T_camera_tag`: without the last correction.
  Eigen::Isometry3d as_printed(const Eigen::Isometry3d& T_camera_tag) const { return T_camera_tag * T_tag_print_; }

 private:
  bool contradicts(const TiltDifference& difference, const PoseCandidate& candidate) const;

  double size_m_, focal_px_;
  int contradictions_ = 0;  ///< frames in a row
  double contradicted_rad_ = 0;
  std::optional<bool> flat_;  ///< the print's bias is that of a flat print and a calibrated lens; empty: no frame yet
  int count_ = 0;
  TiltDifference mean_;
  Eigen::Isometry3d T_tag_print_ = Eigen::Isometry3d::Identity();
};

}  // namespace lumigraft::reconstruct
