#pragma once
// What a calibration says, for people and for the configuration.
#include <optional>
#include <ostream>
#include <string>

#include "reconstruct/calibrate_camera.h"

namespace lumigraft {

struct CalibratedCamera {
  CameraCalibration calibration;
  std::string serial;  ///< empty: not known
};

/// Lens, uncertainties, residuals, and a map of where corners were seen.
void write_calibration_report(std::ostream& out, const std::string& name, const CameraCalibration& calibration);

/// The file that `calibration = "FILE"` of a session or configuration names.
void write_calibration_file(std::ostream& out, const std::optional<CalibratedCamera>& color,
                            const std::optional<CalibratedCamera>& fisheye);

}  // namespace lumigraft
