#pragma once
// Tag corners with an accuracy of hundredths of a pixel, estimated from all pixels of the printed tag.
//
// The camera is unknown, so no pose can be fitted as in pose_alignment. Instead the homography from the print to a
// plane in front of the camera is fitted (Lucas & Kanade 1981; Baker & Matthews 2004, forward additive): to the picture
// itself while the lens is unknown, else to the view of a distortion-free virtual camera directed at the tag.
#include <Eigen/Core>
#include <optional>

#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

struct PrintCorners {
  TagCorners pixels;
  Eigen::Matrix<double, 8, 8> covariance;  ///< px²; u and v of each corner in turn
  double paper = 0;                        ///< light of the paper at the tag's centre, 1 is the picture's maximum
  double contrast_error = 0;               ///< RMS of picture minus model, as a fraction of paper minus ink
};

/// `start` must be accurate to one or two pixels. `camera` is null while the lens is unknown. `light` is from
/// linear_light(). Empty where the print does not match or extends beyond the picture.
std::optional<PrintCorners> print_corners(const capture::Image<std::uint16_t>& light, const TagPattern& pattern,
                                          const TagCorners& start, const capture::CameraModel* camera);

}  // namespace lumigraft::reconstruct
