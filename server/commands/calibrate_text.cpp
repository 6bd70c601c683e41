#include "server/commands/calibrate_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "capture/message_text.h"
#include "capture/session/parameters.h"
#include "reconstruct/math/rotation_vector.h"

namespace lumigraft::server {
namespace {

using capture::formatted;

constexpr double kDegrees = 180 / std::numbers::pi;

/// Enough digits to read the same number back, always with a decimal point: TOML distinguishes integers from floats.
std::string number(double value) {
  const std::string digits = formatted("%.12g", value);
  return digits.find_first_of(".en") == std::string::npos ? digits + ".0" : digits;
}

template <typename Numbers>
std::string array_of(const Numbers& numbers) {
  std::string text = "[";
  for (const double value : numbers) text += (text.size() > 1 ? ", " : "") + number(value);
  return text + "]";
}

std::string rows_of(const Eigen::Isometry3d& T) {
  std::string text = "[";
  for (int row = 0; row < 4; ++row) {
    const Eigen::Vector4d numbers = T.matrix().row(row);
    text += (row > 0 ? ", " : "") + array_of(numbers);
  }
  return text + "]\n";
}

/// Writes why something was not found.
bool refused(std::ostream& out, const std::string& what, const std::string& refusal) {
  if (!refusal.empty()) out << what << ": not found: " << refusal << '\n';
  return !refusal.empty();
}

/// Translation and rotation between two cameras, with 1σ.
void write_transform(std::ostream& out, const Eigen::Isometry3d& T, const Eigen::Vector3d& shift_sigma_m,
                     const Eigen::Vector3d& turn_sigma_rad) {
  const Eigen::Vector3d shift_mm = 1e3 * T.translation(), sigma_mm = 1e3 * shift_sigma_m;
  const Eigen::Vector3d turn_degrees = kDegrees * reconstruct::rotation_vector(T.linear());
  const Eigen::Vector3d sigma = kDegrees * turn_sigma_rad;
  out << formatted("  shift = %.2f %.2f %.2f ± %.2f %.2f %.2f mm\n", shift_mm.x(), shift_mm.y(), shift_mm.z(),
                   sigma_mm.x(), sigma_mm.y(), sigma_mm.z());
  out << formatted("  turn = %.3f %.3f %.3f ± %.3f %.3f %.3f degrees\n", turn_degrees.x(), turn_degrees.y(),
                   turn_degrees.z(), sigma.x(), sigma.y(), sigma.z());
}

void write_size(std::ostream& out, int width, int height, const std::string& serial) {
  out << "width = " << width << "\nheight = " << height << '\n';
  if (!serial.empty()) out << "serial = \"" << serial << "\"\n";
}

void write_head(std::ostream& out, const char* table, const CalibratedCamera& camera) {
  const reconstruct::CameraCalibration& c = camera.calibration;
  out << formatted("\n[%s]\n# %d views, %d corners: %.3f px in the median, 95 %% below %.3f px\n", table, c.views,
                   c.corners, c.median_px, c.percent95_px);
  write_size(out, c.model.width, c.model.height, camera.serial);
}

void write_focal(std::ostream& out, const capture::CameraModel& model) {
  out << "fx = " << number(model.fx) << "\nfy = " << number(model.fy) << "\ncx = " << number(model.cx)
      << "\ncy = " << number(model.cy) << '\n';
}

}  // namespace

void write_calibration_report(std::ostream& out, const std::string& name, const reconstruct::CameraCalibration& c) {
  const bool pinhole = c.model.kind == capture::CameraModel::Kind::pinhole;
  out << formatted("%s: %d views, %d corners, %d of them left out\n", name.c_str(), c.views, c.corners, c.outliers);
  if (c.corners == 0) return;
  out << formatted("  residual: %.3f px in the median, 95 %% below %.3f px\n", c.median_px, c.percent95_px);
  constexpr std::array kPinhole = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
  constexpr std::array kFisheye = {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  const reconstruct::LensNumbers lens = reconstruct::lens_numbers(c.model);
  for (std::size_t i = 0; i < (pinhole ? kPinhole.size() : kFisheye.size()); ++i)
    out << formatted(i < 4 ? "  %s = %.3f ± %.3f px\n" : "  %s = %.6f ± %.6f\n", pinhole ? kPinhole[i] : kFisheye[i],
                     lens[i], c.sigma[i]);
  out << formatted("  a place in the picture is known to %.2f px or better (1 sigma)\n", c.widest_sigma_px);
  const reconstruct::Coverage& seen = c.coverage;
  if (pinhole)
    out << formatted("  corners in %.0f %% of the picture:\n", 100 * seen.reached());
  else
    out << formatted(
        "  corners in %.0f %% of the field, up to %.1f° of %.1f° from the axis; a line for each 10°, from the "
        "right clockwise:\n",
        100 * seen.reached(), seen.widest_rad * kDegrees, seen.field_rad * kDegrees);
  const std::string map = seen.map();
  for (std::size_t from = 0; from < map.size();) {
    const std::size_t end = map.find('\n', from);
    out << "    " << map.substr(from, end - from) << '\n';
    from = end + 1;
  }
}

void write_extrinsics_report(std::ostream& out, const reconstruct::ExtrinsicsCalibration& extrinsics) {
  if (refused(out, "fish-eye to colour", extrinsics.refusal)) return;
  out << formatted("fish-eye to colour: %d moments, %.3f px in the median\n", extrinsics.moments, extrinsics.median_px);
  write_transform(out, extrinsics.T_second_first, extrinsics.shift_sigma_m, extrinsics.turn_sigma_rad);
}

void write_vignetting_report(std::ostream& out, const std::string& name, const reconstruct::VignettingCalibration& v) {
  if (refused(out, name + "'s vignetting", v.refusal)) return;
  out << formatted("%s's vignetting: %d tags in %d views, readings to %.1f %%, boards lit unevenly by %.0f %%\n",
                   name.c_str(), v.samples, v.moments, 100 * v.residual, 100 * v.unevenness);
  const int step = v.field_rad * kDegrees < 60 ? 10 : 30;
  for (int degrees = step; degrees * 1.0 <= v.field_rad * kDegrees; degrees += step)
    out << formatted("  %.3f of the axis' light at %d°\n", v.vignetting.transmission(degrees / kDegrees), degrees);
  out << formatted("  known to %.1f %% or better (1 sigma), seen up to %.1f°\n", 100 * v.widest_sigma,
                   v.widest_rad * kDegrees);
}

void write_time_report(std::ostream& out, const reconstruct::TimeOffsetCalibration& time) {
  if (refused(out, "fish-eye's time offset", time.refusal)) return;
  out << formatted(
      "fish-eye's time offset: %.2f ± %.2f ms, from %d pictures of a board at %.0f px/s, %.2f px in the median\n",
      1e3 * time.offset_s, 1e3 * time.sigma_s, time.pictures, time.speed_px, time.median_px);
}

void write_depth_report(std::ostream& out, const reconstruct::DepthCalibration& depth) {
  if (refused(out, "depth to colour", depth.refusal)) return;
  out << formatted("depth to colour: %d views, depth %.2f mm from the boards in the median\n", depth.views,
                   1e3 * depth.median_m);
  write_transform(out, depth.T_color_depth, depth.shift_sigma_m, depth.turn_sigma_rad);
}

void write_depth_noise_report(std::ostream& out, capture::DepthPrinciple principle,
                              const reconstruct::DepthNoiseCalibration& noise) {
  if (noise.views > 0)
    out << formatted("depth noise: %.2f times that of a usual %s camera, from %d views at %.2f to %.2f m\n",
                     noise.scale, capture::name_of(principle), noise.views, noise.nearest_m, noise.far_m);
}

void write_calibration_file(std::ostream& out, const std::optional<CalibratedCamera>& color,
                            const std::optional<CalibratedCamera>& fisheye, const CalibratedRest& rest) {
  out << "# Written by lumigraft calibrate. A session or configuration takes it with: calibration = \"THIS FILE\"\n"
         "format = 1\n";
  if (color) {
    write_head(out, "color", *color);
    write_focal(out, color->calibration.model);
    out << "distortion = " << array_of(color->calibration.model.distortion) << '\n';
    if (rest.vignetting[0]) out << "vignetting = " << array_of(rest.vignetting[0]->terms) << '\n';
  }
  if (fisheye) {
    const capture::CameraModel& model = fisheye->calibration.model;
    write_head(out, "fisheye", *fisheye);
    out << "model = \"kannala-brandt\"\n";
    write_focal(out, model);
    // Rounded down: beyond this angle the polynomial may decrease.
    out << "k = " << array_of(model.k)
        << "\nfov_degrees = " << number(std::floor(model.fov_rad * kDegrees * 100 + 1e-6) / 100) << '\n';
    if (rest.vignetting[1]) out << "vignetting = " << array_of(rest.vignetting[1]->terms) << '\n';
    if (rest.time_offset_s) out << "time_offset_s = " << number(*rest.time_offset_s) << '\n';
    if (rest.T_tag_fisheye) out << "T_tag_fisheye = " << rows_of(*rest.T_tag_fisheye);
  }
  if (rest.depth) {
    out << "\n[depth]\n";
    write_size(out, rest.depth->width, rest.depth->height, rest.depth->serial);
    // What is outside would be refused.
    out << "noise_scale = "
        << number(std::clamp(rest.depth->noise_scale, capture::kSessionLimits.min_noise_scale,
                             capture::kSessionLimits.max_noise_scale))
        << '\n'
        << "T_color_depth = " << rows_of(rest.depth->T_color_depth);
  }
}

}  // namespace lumigraft::server
