#pragma once
// The tag's pose from every pixel of its print, not just its corners.
//
// A corner detector sees four points; the print has some hundred edges. Their places in the picture follow from the
// pose, so the pose is the one whose rendered print matches the picture best (Lucas & Kanade 1981; Baker & Matthews
// 2004, forward additive). On linear light: an edge pixel mixes ink and paper by area there, and nowhere else.
#include <Eigen/Geometry>
#include <optional>

#include "capture/camera_model.h"
#include "capture/image.h"
#include "reconstruct/pose_tag.h"

namespace lumigraft {

struct Alignment {
  Eigen::Isometry3d T_camera_tag = Eigen::Isometry3d::Identity();
  int pixels = 0;               ///< that saw the tag
  double contrast_error = 0;    ///< RMS of picture minus print, as a share of paper minus ink
  double position_sigma_m = 0;  ///< 1σ of the translation's length, from the residuals
  double angle_sigma_rad = 0;   ///< 1σ of the turn
};

/// `linear` has one channel of linear light in any unit. Empty where the print does not match, or too little of it is
/// in the picture.
std::optional<Alignment> align_to_print(const Image<float>& linear, const CameraModel& camera,
                                        const TagPattern& pattern, double size_m,
                                        const Eigen::Isometry3d& T_camera_tag);

}  // namespace lumigraft
