#pragma once
// Images of a tag on a table with known camera pose, rendered from the print with many samples per pixel.
#include <Eigen/Geometry>
#include <random>

#include "capture/camera/camera_model.h"
#include "capture/camera/srgb.h"
#include "capture/frame.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::test {

inline constexpr double kDegree = M_PI / 180;
inline constexpr std::int64_t kFrameNs = 33'333'333;  ///< at 30 Hz

inline capture::Tag some_tag() { return capture::Tag{"tag36h11", 2, 0.16}; }

inline capture::CameraModel small_camera() {
  capture::CameraModel camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 262.5;
  camera.cx = 159.5;
  camera.cy = 119.5;
  return camera;
}

/// T_tag_camera of a camera at `distance_m` from the tag's centre, `tilt_rad` from its normal and `azimuth_rad` around
/// it, that looks at `aim_m`.
inline Eigen::Isometry3d looking_at_tag(double distance_m, double tilt_rad, double azimuth_rad,
                                        const Eigen::Vector3d& aim_m = Eigen::Vector3d::Zero()) {
  const Eigen::Vector3d from(distance_m * std::sin(tilt_rad) * std::cos(azimuth_rad),
                             distance_m * std::sin(tilt_rad) * std::sin(azimuth_rad), distance_m * std::cos(tilt_rad));
  const Eigen::Vector3d z = (aim_m - from).normalized();
  const Eigen::Vector3d up = std::abs(z.z()) > 0.99 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d x = z.cross(up).normalized();
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();
  T_tag_camera.linear() << x, z.cross(x), z;
  T_tag_camera.translation() = from;
  return T_tag_camera;
}

struct ViewNoise {
  double code_sigma = 0;  ///< added to every 8-bit value
  unsigned seed = 1;
  double exposure = 1;   ///< factor on the light before clipping
  double lens_blur = 0;  ///< 1σ in pixels of a Gaussian blur before clipping
};
constexpr double kPaperLight = 0.7;  ///< at exposure 1, at the tag's centre

/// Gaussian blur, rows and then columns.
inline void blur(capture::Image<double>& light, double sigma_px) {
  const int reach = static_cast<int>(std::ceil(3 * sigma_px));
  for (const bool rows : {true, false}) {
    const capture::Image<double> from = light;
    for (int v = 0; v < light.height; ++v)
      for (int u = 0; u < light.width; ++u) {
        double sum = 0, weights = 0;
        for (int i = -reach; i <= reach; ++i) {
          const int x = rows ? u + i : u, y = rows ? v : v + i;
          if (x < 0 || y < 0 || x >= light.width || y >= light.height) continue;
          const double weight = std::exp(-i * i / (2 * sigma_px * sigma_px));
          sum += weight * from.at(x, y);
          weights += weight;
        }
        light.at(u, v) = sum / weights;
      }
  }
}

/// `pose_at`: T_tag_camera when a row of the image is exposed.
template <typename PoseAt>
capture::Frame rolling_view_of_tag(const capture::CameraModel& camera, const reconstruct::TagPattern& pattern,
                                   double size_m, const PoseAt& pose_at, const ViewNoise& noise = {}) {
  constexpr int kSamples = 6;
  constexpr double kInk = 0.03, kTable = 0.25;
  const double cell_m = size_m / pattern.square_cells;
  capture::Frame picture;
  picture.encoded = capture::Image<std::uint8_t>(camera.width, camera.height, 3);
  std::mt19937 random(noise.seed);
  std::normal_distribution<double> gauss(0, 1);
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();
  const auto on_table = [&](const Eigen::Vector2d& pixel) -> std::optional<Eigen::Vector3d> {
    const auto ray = camera.unproject(pixel);
    if (!ray) return std::nullopt;
    const Eigen::Vector3d d = T_tag_camera.linear() * *ray;
    if (!(d.z() < 0)) return std::nullopt;
    return T_tag_camera.translation() - T_tag_camera.translation().z() / d.z() * d;
  };
  capture::Image<double> linear(camera.width, camera.height, 1);
  for (int v = 0; v < camera.height; ++v) {
    T_tag_camera = pose_at(v);
    for (int u = 0; u < camera.width; ++u) {
      // There are no edges outside the print.
      const auto centre = on_table({static_cast<double>(u), static_cast<double>(v)});
      const int samples = centre && centre->cwiseAbs().maxCoeff() < pattern.cells * cell_m ? kSamples : 1;
      double& light = linear.at(u, v);
      for (int s = 0; s < samples * samples; ++s) {
        const Eigen::Vector2d pixel(u - 0.5 + (s % samples + 0.5) / samples, v - 0.5 + (s / samples + 0.5) / samples);
        const auto point = on_table(pixel);
        if (!point) continue;
        const Eigen::Vector3d& p = *point;
        const double column = p.x() / cell_m + pattern.cells / 2.0, row = pattern.cells / 2.0 - p.y() / cell_m;
        const bool on_print = column >= 0 && row >= 0 && column < pattern.cells && row < pattern.cells;
        const double albedo = !on_print ? kTable : pattern.white_at(column, row) ? kPaperLight : kInk;
        light += albedo * (1 + 0.5 * p.x()) / (samples * samples);  // a lamp to the right
      }
    }
  }
  if (noise.lens_blur > 0) blur(linear, noise.lens_blur);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const double exact = 255 * capture::linear_to_srgb(static_cast<float>(noise.exposure * linear.at(u, v)));
      for (int c = 0; c < 3; ++c) {
        const double code = exact + noise.code_sigma * gauss(random);
        picture.encoded.at(u, v, c) = static_cast<std::uint8_t>(std::clamp(std::lround(code), 0l, 255l));
      }
    }
  return picture;
}

inline capture::Frame view_of_tag(const capture::CameraModel& camera, const reconstruct::TagPattern& pattern,
                                  double size_m, const Eigen::Isometry3d& T_tag_camera, const ViewNoise& noise = {}) {
  return rolling_view_of_tag(
      camera, pattern, size_m, [&](double) { return T_tag_camera; }, noise);
}

inline capture::FrameSet frame_of(capture::Frame picture, std::uint64_t index, std::int64_t time_ns) {
  capture::FrameSet frame;
  frame.index = index;
  frame.time_ns = time_ns;
  picture.stamp.time_ns = time_ns;
  frame.color = std::make_shared<capture::Frame>(std::move(picture));
  return frame;
}

/// A camera that moves evenly, and whose rows are exposed one after the other. Times are relative to that at which it
/// was at a given pose.
struct RollingShutter {
  double readout_s = 0;  ///< from the first row to the last
  Eigen::Vector3d turn_rad_s = Eigen::Vector3d::Zero(), speed_m_s = Eigen::Vector3d::Zero();  ///< camera frame

  Eigen::Isometry3d at(const Eigen::Isometry3d& T_tag_camera, double seconds) const {
    Eigen::Isometry3d moved = T_tag_camera;
    moved.translate(seconds * speed_m_s);
    const double angle = seconds * turn_rad_s.norm();
    if (angle != 0) moved.rotate(Eigen::AngleAxisd(angle, turn_rad_s.normalized()));
    return moved;
  }
  /// From the exposure of `tag_row` to that of `row`.
  double seconds(const capture::CameraModel& camera, double row, double tag_row) const {
    return (row - tag_row) / (camera.height - 1) * readout_s;
  }
  /// What `stage` says of the tag after three frames at 30 Hz, in the last of which the camera is at `T_tag_camera`
  /// when the row of the tag's centre is exposed.
  template <typename Stage>
  auto locate(Stage& stage, const capture::CameraModel& camera, const Eigen::Isometry3d& T_tag_camera) const {
    const reconstruct::TagPattern pattern = reconstruct::TagFinder(some_tag()).pattern();
    const double tag_row = camera.project(T_tag_camera.inverse().translation())->y();
    for (int frame = 0;; ++frame) {
      const double from_s = 1e-9 * kFrameNs * (frame - 2);
      const auto pose_at = [&](double row) { return at(T_tag_camera, from_s + seconds(camera, row, tag_row)); };
      const ViewNoise noise{1, static_cast<unsigned>(frame) + 1};
      const auto result = stage.locate(
          frame_of(rolling_view_of_tag(camera, pattern, some_tag().size_m, pose_at, noise), frame, frame * kFrameNs));
      if (frame == 2) return result;
    }
  }
};

/// Depth z of the hit at from + along(from, d) · d (tag frame, metres; not finite: no hit), with `noise_scale` times
/// the noise of a structured-light camera (Nguyen, Izadi & Lovell 2012, eq. 2).
template <typename Along>
capture::DepthFrame depth_picture(const capture::CameraModel& camera, const Eigen::Isometry3d& T_tag_camera,
                                  unsigned seed, double noise_scale, const Along& along) {
  capture::DepthFrame depth;
  depth.depth_m = capture::Image<float>(camera.width, camera.height, 1);
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss(0, 1);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      if (!ray) continue;
      const double z = along(T_tag_camera.translation(), Eigen::Vector3d(T_tag_camera.linear() * *ray)) * ray->z();
      if (z > 0 && z < 8)
        depth.depth_m.at(u, v) =
            static_cast<float>(z + noise_scale * (0.0012 + 0.0019 * (z - 0.4) * (z - 0.4)) * gauss(random));
    }
  return depth;
}

/// Depth of the table z = 0.
inline capture::DepthFrame depth_of_table(const capture::CameraModel& camera, const Eigen::Isometry3d& T_tag_camera,
                                          unsigned seed, double noise_scale) {
  return depth_picture(camera, T_tag_camera, seed, noise_scale,
                       [](const Eigen::Vector3d& from, const Eigen::Vector3d& d) { return -from.z() / d.z(); });
}

inline double millimetres_apart(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return 1e3 * (a.translation() - b.translation()).norm();
}
inline double degrees_apart(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle() * 180 / M_PI;
}

}  // namespace lumigraft::test
