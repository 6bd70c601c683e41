#pragma once
// A table of coloured tiles before a wall whose depth is measured: its colours decide whether it is a mirror.
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::test {

inline constexpr double kWall_m = 0.5, kTile_m = 0.12;

inline double table_and_wall(const Eigen::Vector3d& p) { return std::min(p.z(), kWall_m - p.y()); }
inline bool on_wall(const Eigen::Vector3d& p) { return kWall_m - p.y() < p.z(); }

/// One of many colours for each tile of a plane.
inline Eigen::Vector3d tile(double x, double y) {
  std::mt19937 random(static_cast<unsigned>(1000 * std::floor(x / kTile_m) + std::floor(y / kTile_m) + 1e6));
  std::uniform_real_distribution<double> channel(0.05, 0.45);
  const double red = channel(random), green = channel(random);
  return {red, green, channel(random)};
}
inline Eigen::Vector3d tiled_table(const Eigen::Vector3d& p) { return tile(p.x(), p.y()); }

/// Radiance of a point towards a camera.
using Look = std::function<Eigen::Vector3d(const Eigen::Vector3d& p, const Eigen::Vector3d& camera)>;

inline Look mirror_of(double reflectance, const Eigen::Vector3d& own) {
  return [=](const Eigen::Vector3d& p, const Eigen::Vector3d& camera) -> Eigen::Vector3d {
    if (!on_wall(p)) return tiled_table(p);
    Eigen::Vector3d along = (p - camera).normalized();
    along.y() = -along.y();
    const Eigen::Vector3d from = p - 1e-3 * Eigen::Vector3d::UnitY();
    const auto far = march(table_and_wall, from, along);
    return own + reflectance * (far ? tiled_table(from + *far * along) : Eigen::Vector3d(0.1, 0.1, 0.1));
  };
}

/// As seen from 1.6 m, by one frame from each azimuth.
inline std::shared_ptr<const reconstruct::DistanceField> fused(const Look& look,
                                                               const std::vector<double>& azimuths_deg) {
  const capture::CameraModel camera = small_camera();
  reconstruct::FusionStage stage(session_with(camera), {});
  std::shared_ptr<const reconstruct::DistanceField> field;
  unsigned index = 0;
  for (const double azimuth : azimuths_deg) {
    const Eigen::Isometry3d T = looking_at_tag(1.6, 60 * kDegree, azimuth * kDegree, {0, 0.3, 0.2});
    capture::FrameSet frame = frame_of(table_and_wall, camera, T, index, {0.5, index + 1});
    auto color = std::make_shared<capture::Frame>(*frame.color);
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
        const Eigen::Vector3d along = T.linear() * *ray;
        const auto far = march(table_and_wall, T.translation(), along);
        const Eigen::Vector3d seen =
            far ? look(T.translation() + *far * along, T.translation()) : Eigen::Vector3d::Zero();
        for (int c = 0; c < 3; ++c)
          color->encoded.at(u, v, c) = static_cast<std::uint8_t>(
              std::lround(255 * capture::linear_to_srgb(std::min(1.0f, static_cast<float>(2 * seen[c])))));
      }
    frame.color = color;
    field = fuse_all(stage, frame, pose_at(T));
    ++index;
  }
  return field;
}

}  // namespace lumigraft::test
