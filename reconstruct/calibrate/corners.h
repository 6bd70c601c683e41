#pragma once
// A tag's corners to hundredths of a pixel, from every pixel of its print.
//
// The camera is what is looked for, so no pose can be fitted as in pose_alignment. What is fitted is the homography
// from the print to a plane before the camera (Lucas & Kanade 1981; Baker & Matthews 2004, forward additive): to the
// picture itself while nothing is known of the lens, else to the picture as a camera without distortion would see it
// that looks at the tag.
#include <Eigen/Core>
#include <optional>

#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

struct PrintCorners {
  TagCorners pixels;
  Eigen::Matrix<double, 8, 8> covariance;  ///< px²; u and v of each corner in turn
  double paper = 0;                        ///< its light at the tag's centre, 1 is the brightest that there is
  double contrast_error = 0;               ///< RMS of picture minus print, as a share of paper minus ink
};

/// Starts from corners that are right to a pixel or two. `camera` is null while nothing is known of the lens. Empty
/// where the print does not match, or leaves the picture. `light` as linear_light() has it.
std::optional<PrintCorners> print_corners(const capture::Image<std::uint16_t>& light, const TagPattern& pattern,
                                          const TagCorners& start, const capture::CameraModel* camera);

}  // namespace lumigraft::reconstruct
