#pragma once
// Writes calibration results as a report for people and as a configuration file.
#include <array>
#include <optional>
#include <ostream>
#include <string>

#include "reconstruct/calibrate/camera.h"
#include "reconstruct/calibrate/depth.h"
#include "reconstruct/calibrate/depth_noise.h"
#include "reconstruct/calibrate/extrinsics.h"
#include "reconstruct/calibrate/time_offset.h"
#include "reconstruct/calibrate/vignetting.h"

namespace lumigraft::server {

struct CalibratedCamera {
  reconstruct::CameraCalibration calibration;
  std::string serial;  ///< empty: not known
};

/// Lens, uncertainties, residuals, and a map of where corners were seen.
void write_calibration_report(std::ostream& out, const std::string& name,
                              const reconstruct::CameraCalibration& calibration);

/// Pose of the fish-eye relative to the colour camera.
void write_extrinsics_report(std::ostream& out, const reconstruct::ExtrinsicsCalibration& extrinsics);

/// Vignetting of the lens of the camera `name`.
void write_vignetting_report(std::ostream& out, const std::string& name,
                             const reconstruct::VignettingCalibration& vignetting);

/// Time offset of the fish-eye's clock.
void write_time_report(std::ostream& out, const reconstruct::TimeOffsetCalibration& time);

/// Pose of the depth camera relative to the colour camera.
void write_depth_report(std::ostream& out, const reconstruct::DepthCalibration& depth);
void write_depth_noise_report(std::ostream& out, capture::DepthPrinciple principle,
                              const reconstruct::DepthNoiseCalibration& noise);

/// Results other than the lenses, where the pictures determine them.
struct CalibratedRest {
  std::optional<Eigen::Isometry3d> T_tag_fisheye;
  std::array<std::optional<capture::Vignetting>, 2> vignetting;  ///< of the colour camera, of the fish-eye
  std::optional<double> time_offset_s;
  struct Depth {
    int width = 0, height = 0;
    std::string serial;
    Eigen::Isometry3d T_color_depth;
    double noise_scale = 1;
  };
  std::optional<Depth> depth;
};

/// The file that `calibration = "FILE"` of a session or configuration names.
void write_calibration_file(std::ostream& out, const std::optional<CalibratedCamera>& color,
                            const std::optional<CalibratedCamera>& fisheye, const CalibratedRest& rest);

}  // namespace lumigraft::server
