#pragma once
// Estimates a camera's response from pictures of a static scene at several exposures (Debevec & Malik 1997, eq. 3).
#include <array>
#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "capture/image.h"

namespace lumigraft::reconstruct {

struct ExposedPicture {
  double exposure = 1;  ///< in any unit: only ratios matter
  capture::Image<std::uint8_t> encoded;
};

struct ResponseCalibration {
  std::array<std::array<double, 256>, 3> linear{};  ///< by channel and pixel value; 1 at 255
  std::array<std::array<double, 256>, 3> sigma{};   ///< relative 1σ of `linear`
  double residual = 0;                              ///< median relative difference of a pixel's light between exposures
  int darkest = 0, brightest = 0;                   ///< range of pixel values observed at several exposures
  std::string refusal;                              ///< why it is rejected, on one line; empty where accepted
};

/// Throws InputError where the pictures differ in size.
ResponseCalibration calibrate_response(const std::vector<ExposedPicture>& pictures);

/// Writes the table that `response = "FILE"` names.
void write_response_file(std::ostream& out, const ResponseCalibration& calibration);

}  // namespace lumigraft::reconstruct
