#pragma once
// Error measures of a composited picture against the path-traced truth of a session.
//
// The truth is L_rho plus, wherever no object covers the pixel, the difference between the camera picture and L_mu
// (noise, blur, 8-bit rounding); so adding the exact change to the camera picture has no error. Displayed values are
// sRGB(clip(exposure · L, 0, 1)). A measure is NaN where it has no pixels.
#include <cstdint>
#include <filesystem>

#include "capture/image.h"

namespace lumigraft::server {

struct Measures {
  double relight_error =
      0;  ///< RMS(result - truth) / RMS(L_rho - L_mu) over the relit pixels, linear; 1 = no change rendered
  double object_error = 0;      ///< RMS(result - truth) / RMS(truth) over the object's pixels, linear
  double psnr_db = 0;           ///< whole picture, displayed values
  double psnr_affected_db = 0;  ///< pixels that the object changes by more than 2/255
  double psnr_object_db = 0;    ///< pixels at least half covered by the object
  double psnr_relit_db = 0;     ///< affected pixels without any object: shadows, colour bleeding, reflections
  double flip = 0;              ///< mean LDR-FLIP
};

/// The true pictures of one frame: linear values of the exposed camera, clipped to [0, 1].
struct TruePictures {
  capture::Image<float> background, augmented;  ///< L_mu, L_rho; R G B
  capture::Image<float> coverage;               ///< of virtual objects
};

/// `truth` is a folder with background.exr, augmented.exr and object_mask.png. Throws InputError.
TruePictures read_true_pictures(const std::filesystem::path& truth, double exposure);

/// 8-bit sRGB pictures of the truth's size. Throws InputError where the sizes differ.
Measures measure_picture(const capture::Image<std::uint8_t>& picture, const capture::Image<std::uint8_t>& camera,
                         const TruePictures& truth);

}  // namespace lumigraft::server
