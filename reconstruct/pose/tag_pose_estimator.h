#pragma once
// Candidates for the camera pose from one sighting of a tag.
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/response.h"
#include "capture/frame.h"
#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/print_alignment.h"
#include "reconstruct/pose/rolling_shutter.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

/// Normal of the surface around a tag by depth, in the frame of the print: x and y of the unit vector.
struct TiltDifference {
  Eigen::Vector2d normal_xy = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< of depth
};

/// One of the poses that explain a sighting.
struct PoseCandidate {
  Eigen::Isometry3d T_camera_tag = Eigen::Isometry3d::Identity();
  double error_px = 0;                               ///< RMS over the corners; 0 if they were not detected
  double position_sigma_m = 0, angle_sigma_rad = 0;  ///< noise of T_camera_tag
  PoseCovariance noise = PoseCovariance::Zero();     ///< of the camera in the tag frame, independent in each frame
  PoseCovariance bias = PoseCovariance::Zero();      ///< the part that is the same in all frames
  std::optional<Alignment> alignment;
  std::optional<TiltDifference> tilt_by_depth;                    ///< before its correction (TagTilt),
  Eigen::Isometry3d T_tag_print = Eigen::Isometry3d::Identity();  ///< and that correction
  /// Of the print against the surface around it, if no bias of the print explains that; else 0. Depth is not used then.
  double contradicted_rad = 0;
  bool flat_print = true;  ///< its normal is that of the surface around it, as far as depth shows (TagTilt)
  double cost = 0;         ///< sum of evidence terms against it: squared deviations in σ, each at most evidence_cap
};

/// Further evidence for the choice between candidates.
struct PoseHints {
  std::optional<Eigen::Isometry3d> T_camera_tag_before;
  double elapsed_s = 0;  ///< since that pose
  const capture::Image<float>* depth_m = nullptr;
  ImageMotion motion = {};
};

class TagPoseEstimator {
 public:
  TagPoseEstimator(const TagPattern& pattern, double size_m, const capture::CameraModel& camera,
                   const capture::Response& response);

  /// Both poses that explain the corners (Schweighofer & Pinz 2006) if they differ, aligned to the whole print.
  std::vector<PoseCandidate> estimate(const TagCorners& corners, const capture::Frame& picture,
                                      const PoseHints& hints) const;
  /// The pose from the visible part of the print, if the square is not detected. Empty if too little is visible, or the
  /// result is not near `T_camera_tag`.
  std::optional<PoseCandidate> follow(const capture::Frame& picture, const Eigen::Isometry3d& T_camera_tag,
                                      const PrintAppearance& appearance, const ImageMotion& motion = {}) const;
  /// Corners of a tag in the image; empty if one is not in front of the camera.
  std::optional<TagCorners> corners_at(const Eigen::Isometry3d& T_camera_tag) const;
  struct SearchRegion {
    PixelRegion pixels;
    double narrowest_px;  ///< width of the print
  };
  /// Where to search for the print if the camera hardly moved. Empty if that is more than half of the image.
  std::optional<SearchRegion> search_region(const Eigen::Isometry3d& T_camera_tag) const;

 private:
  void align(PoseCandidate& candidate, const std::vector<PixelSample>& pixels) const;
  PoseCovariance bias_of(const PoseCandidate& candidate, const ImageMotion& motion) const;
  void compute_costs(std::vector<PoseCandidate>& candidates, const PoseHints& hints) const;

  TagPattern pattern_;
  double size_m_;
  capture::CameraModel camera_;
  capture::Response response_;
};

/// The region of the points with a margin for the motion between two frames (half their extent), aligned with the tiles
/// of the detector, so that it processes the same tiles as in the whole image.
PixelRegion tiles_around(const TagCorners& points, const capture::CameraModel& camera);
/// Smallest width of a quadrangle, pixels.
double narrowest_px(const TagCorners& points);

}  // namespace lumigraft::reconstruct
