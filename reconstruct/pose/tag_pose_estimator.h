#pragma once
// What one sighting of a tag says about where the camera stands.
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/response.h"
#include "capture/frame.h"
#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/print_alignment.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

struct PoseCandidate {
  Eigen::Isometry3d T_camera_tag = Eigen::Isometry3d::Identity();
  double error_px = 0;  ///< RMS over the corners; 0 where they were not seen
  double position_sigma_m = 0;
  double angle_sigma_rad = 0;
  PoseCovariance noise = PoseCovariance::Zero();  ///< of the camera in the tag's frame
  PoseCovariance bias = PoseCovariance::Zero();   ///< the same from picture to picture
  std::optional<Alignment> alignment;
  double cost = 0;  ///< what speaks against it, as squared deviations in σ
};

/// Each witness for a pose counts as squared deviations in σ, and for no more than this.
constexpr double kWitnessCap = 100;

/// What can tell two explanations apart beside the picture.
struct PoseHints {
  std::optional<Eigen::Isometry3d> T_camera_tag_before;
  double passed_s = 0;  ///< since then
  const capture::Image<float>* depth_m = nullptr;
};

class TagPoseEstimator {
 public:
  TagPoseEstimator(const TagPattern& pattern, double size_m, const capture::CameraModel& camera,
                   const capture::Response& response);

  /// Both poses that explain the corners (Schweighofer & Pinz 2006) as far as they differ, aligned to the whole print.
  std::vector<PoseCandidate> explain(const TagCorners& corners, const capture::Picture& picture,
                                     const PoseHints& hints) const;
  /// The pose from the part of the print that shows, where the square is no longer whole. Empty where that is too
  /// little, or not near `T_camera_tag`.
  std::optional<PoseCandidate> follow(const capture::Picture& picture, const Eigen::Isometry3d& T_camera_tag,
                                      const PrintAppearance& look) const;
  struct Place {
    PixelRegion region;
    double narrowest_px;  ///< of the print
  };
  /// Where to look for the print if the camera hardly moved. Empty where that would be most of the picture.
  std::optional<Place> place(const Eigen::Isometry3d& T_camera_tag) const;

 private:
  void align(PoseCandidate& candidate, const std::vector<SeenPixel>& pixels) const;
  void weigh(std::vector<PoseCandidate>& candidates, const PoseHints& hints) const;

  TagPattern pattern_;
  double size_m_;
  capture::CameraModel camera_;
  capture::Response response_;
};

/// The points, and half their extent around them: what a hand moves a tag between two pictures. On the grid of tiles
/// that the detector works in, so that a region shows it the same tiles as the whole picture.
PixelRegion tiles_around(const TagCorners& points, const capture::CameraModel& camera);
/// Across a quadrangle where it is narrowest.
double narrowest_px(const TagCorners& points);

}  // namespace lumigraft::reconstruct
