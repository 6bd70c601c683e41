#pragma once
// How near a composited picture is to the path-traced truth.
//
// The truth compared with is L_rho plus what the camera picture itself has beyond L_mu (noise, blur, 8-bit rounding)
// wherever no object covers it, so adding the exact change to the camera picture is perfect.
#include <filesystem>
#include <string>
#include <vector>

namespace lumigraft {

struct Score {
  double relight_error = 0;  ///< RMS(result - truth) / RMS(L_rho - L_mu) over real, changed pixels, linear; 1 = unchanged
  double object_error = 0;   ///< RMS(result - truth) / RMS(truth) over the object's pixels, linear
  double psnr_db = 0;        ///< whole picture, displayed values
  double psnr_affected_db = 0;  ///< pixels that the object changes by more than 2/255
  double psnr_unchanged_db = 0;  ///< camera picture left as it is: what the result has to beat
};

/// `picture` and `camera` are 8-bit sRGB PNGs, `truth` a folder with background.exr, augmented.exr, object_mask.png.
/// Throws std::runtime_error where a file is missing or sizes differ.
Score score_picture(const std::filesystem::path& picture, const std::filesystem::path& camera,
                    const std::filesystem::path& truth, double exposure);

}  // namespace lumigraft
