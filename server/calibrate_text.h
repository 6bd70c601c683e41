#pragma once
// What a calibration says, for people and for the configuration.
#include <optional>
#include <ostream>
#include <string>

#include "reconstruct/calibrate_camera.h"
#include "reconstruct/calibrate_stand.h"

namespace lumigraft {

struct CalibratedCamera {
  CameraCalibration calibration;
  std::string serial;  ///< empty: not known
};

/// Lens, uncertainties, residuals, and a map of where corners were seen.
void write_calibration_report(std::ostream& out, const std::string& name, const CameraCalibration& calibration);

/// How the fish-eye stands to the colour camera.
void write_stand_report(std::ostream& out, const StandCalibration& stand);

/// The file that `calibration = "FILE"` of a session or configuration names.
void write_calibration_file(std::ostream& out, const std::optional<CalibratedCamera>& color,
                            const std::optional<CalibratedCamera>& fisheye,
                            const std::optional<Eigen::Isometry3d>& T_tag_fisheye);

}  // namespace lumigraft
