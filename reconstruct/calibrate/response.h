#pragma once
// A camera's response from pictures of one still scene at several exposures (Debevec & Malik 1997, eq. 3).
#include <array>
#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "capture/image.h"

namespace lumigraft::reconstruct {

struct ExposedPicture {
  double exposure = 1;  ///< in any unit: ratios count
  capture::Image<std::uint8_t> encoded;
};

struct ResponseCalibration {
  std::array<std::array<double, 256>, 3> linear{};  ///< by channel and code value; 1 at 255
  std::array<std::array<double, 256>, 3> sigma{};   ///< 1σ of it, as a share of itself
  double residual = 0;                              ///< median distance of what pixels say at two exposures, as a share
  int darkest = 0, brightest = 0;                   ///< code values between which pixels were seen at several exposures
  std::string refusal;                              ///< why it is not to be used, on one line; empty where it is
};

/// Throws InputError where the pictures differ in size.
ResponseCalibration calibrate_response(const std::vector<ExposedPicture>& pictures);

/// The table that `response = "FILE"` names.
void write_response_file(std::ostream& out, const ResponseCalibration& calibration);

}  // namespace lumigraft::reconstruct
