#pragma once
// The tag's pose from every pixel of its print, not just its corners.
//
// A corner detector sees four points; the print has some hundred edges. Their places in the picture follow from the
// pose, so the pose is the one whose rendered print matches the picture best (Lucas & Kanade 1981; Baker & Matthews
// 2004, forward additive). On linear light: an edge pixel mixes ink and paper by area there, and nowhere else. Paper
// that is brighter than the picture can show is cut off, and its edges look displaced into the ink: of such a pixel the
// light is a lower bound and no more (Tobin 1958), and edges are told by their dark side.
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/gray_regions.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

/// How the print appears, found together with the pose.
struct PrintAppearance {
  double ink = 0, paper = 0, slope_x = 0, slope_y = 0;   ///< light; paper changes by the slopes across half the tag
  double blur = 1;                                       ///< how much wider than a pixel the lens blurs
  double end = std::numeric_limits<double>::infinity();  ///< light where the picture ends; infinite where that is above

  double contrast() const { return std::min(paper, end) - ink; }  ///< as far as it shows
};

struct Alignment {
  Eigen::Isometry3d T_camera_tag = Eigen::Isometry3d::Identity();
  PrintAppearance look;
  int pixels = 0;               ///< that saw the tag, and were not cut off
  double cut_share = 0;         ///< of the pixels on edges: cut off
  double contrast_error = 0;    ///< RMS of picture minus print, as a share of the look's contrast
  double position_sigma_m = 0;  ///< 1σ of the translation's length, from the residuals
  double angle_sigma_rad = 0;   ///< 1σ of the turn
  PoseCovariance covariance = PoseCovariance::Zero();  ///< the same, of the camera in the tag's frame
};

/// Of `seen`, the pixels that see the tag count. Starts from a pose, and from a look where one is known. Empty where
/// the print does not match, or too little of it is among the pixels.
std::optional<Alignment> align_to_print(const std::vector<SeenPixel>& seen, const TagPattern& pattern, double size_m,
                                        const Eigen::Isometry3d& T_camera_tag,
                                        const std::optional<PrintAppearance>& look = std::nullopt);

}  // namespace lumigraft::reconstruct
