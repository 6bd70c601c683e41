#pragma once
// Pose of a tag from all pixels of its print.
//
// The print has some hundred edges, a corner detector uses four points. The result is the pose whose rendered print
// matches the image best (Lucas & Kanade 1981; Baker & Matthews 2004, forward additive), in linear light, in which an
// edge pixel is the area-weighted mean of ink and paper. A clipped pixel is a lower bound of the light (Tobin 1958):
// with its value as a measurement, edges of bright paper would appear displaced into the ink.
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/gray_regions.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

/// Appearance of the print, estimated together with the pose.
struct PrintAppearance {
  double ink = 0, paper = 0, slope_x = 0, slope_y = 0;  ///< light; paper changes by the slopes over half the tag
  double blur = 1;                                      ///< width of the blur of lens and pixel, in pixels
  double clip_level =
      std::numeric_limits<double>::infinity();  ///< light at which the image clips; infinite: no pixel did

  double contrast() const { return std::min(paper, clip_level) - ink; }  ///< in the image
};

struct Alignment {
  Eigen::Isometry3d T_camera_tag = Eigen::Isometry3d::Identity();
  PrintAppearance appearance;
  int pixels = 0;                                      ///< used; not clipped
  double clipped_fraction = 0;                         ///< of the pixels on edges
  double contrast_error = 0;                           ///< RMS of image minus print, relative to the contrast
  double position_sigma_m = 0;                         ///< 1σ of the translation's length, from the residuals
  double angle_sigma_rad = 0;                          ///< 1σ of the rotation
  PoseCovariance covariance = PoseCovariance::Zero();  ///< of the camera in the tag frame
};

/// Uses those of `samples` on the tag. Starts from a pose, and from an appearance if one is known. Empty if the print
/// does not match, or too little of it is visible.
std::optional<Alignment> align_to_print(const std::vector<PixelSample>& samples, const TagPattern& pattern,
                                        double size_m, const Eigen::Isometry3d& T_camera_tag,
                                        const std::optional<PrintAppearance>& appearance = std::nullopt);

}  // namespace lumigraft::reconstruct
