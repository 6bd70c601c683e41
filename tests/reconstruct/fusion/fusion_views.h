#pragma once
// Synthetic frames of shapes given by signed distances, and comparison of a field with its shape.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <random>

#include "capture/camera/srgb.h"
#include "reconstruct/fusion/fusion.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::test {

inline capture::CameraModel coarse_camera() {
  capture::CameraModel camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 131;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

/// Signed distance to the nearest surface, tag frame; images are made by sphere tracing.
using Shape = std::function<double(const Eigen::Vector3d&)>;

inline double table(const Eigen::Vector3d& p) { return p.z(); }
inline const Eigen::Vector3d kBall(0.1, 0.15, 0.12);
inline constexpr double kBallRadius = 0.1;
inline double ball(const Eigen::Vector3d& p) { return (p - kBall).norm() - kBallRadius; }
inline double ball_on_table(const Eigen::Vector3d& p) { return std::min(table(p), ball(p)); }

/// Distance along the ray to the shape, within `far_m`.
inline std::optional<double> march(const Shape& shape, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                                   double far_m = 6) {
  double along = 0;
  for (int i = 0; i < 500 && along < far_m; ++i) {
    const double free = shape(from + along * direction);
    if (free < 1e-7) break;
    along += free;
  }
  if (along >= far_m) return std::nullopt;
  return along;
}

inline Eigen::Vector3d normal_of(const Shape& shape, const Eigen::Vector3d& p) {
  Eigen::Vector3d normal;
  for (int i = 0; i < 3; ++i)
    normal[i] = shape(p + 1e-4 * Eigen::Vector3d::Unit(i)) - shape(p - 1e-4 * Eigen::Vector3d::Unit(i));
  return normal.normalized();
}

inline capture::Session session_with(const capture::CameraModel& camera) {
  capture::Session session;
  session.color.model = camera;
  session.color.exposure = 2;
  return session;
}

struct Noise {
  double scale = 0;  ///< factor on the noise model
  unsigned seed = 1;
  bool oblique = false;  ///< with the term that grows with incidence
};

inline capture::FrameSet frame_of(const Shape& shape, const capture::CameraModel& camera,
                                  const Eigen::Isometry3d& T_tag_camera, std::uint64_t index = 0,
                                  const Noise& noise = {},
                                  const std::function<double(const Eigen::Vector3d&)>& radiance = nullptr,
                                  double far_m = 6) {
  auto depth = std::make_shared<capture::DepthFrame>();
  depth->depth_m = capture::Image<float>(camera.width, camera.height, 1);
  auto color = std::make_shared<capture::Frame>();
  color->exposure = 2;
  color->encoded = capture::Image<std::uint8_t>(camera.width, camera.height, 3);
  std::mt19937 random(noise.seed);
  std::normal_distribution<double> gauss;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      if (!ray) continue;
      const Eigen::Vector3d direction = T_tag_camera.linear() * *ray;
      const auto along = march(shape, T_tag_camera.translation(), direction, far_m);
      if (!along) continue;
      const double z = *along * ray->z();
      double incidence_rad = 0;
      if (noise.oblique) {
        const Eigen::Vector3d normal = normal_of(shape, T_tag_camera.translation() + *along * direction);
        incidence_rad = std::acos(std::clamp(-normal.dot(direction.normalized()), 0.0, 1.0));
      }
      depth->depth_m.at(u, v) =
          static_cast<float>(z + noise.scale * capture::DepthNoise().sigma_m(z, incidence_rad) * gauss(random));
      const double light = radiance ? radiance(T_tag_camera.translation() + *along * direction) : 0.25;
      for (int c = 0; c < 3; ++c)
        color->encoded.at(u, v, c) = static_cast<std::uint8_t>(std::lround(
            255 * capture::linear_to_srgb(std::min(1.0f, static_cast<float>(2 * light) / static_cast<float>(1 + c)))));
    }
  capture::FrameSet frame;
  frame.index = index;
  frame.depth = depth;
  frame.color = color;
  return frame;
}

inline reconstruct::Pose pose_at(const Eigen::Isometry3d& T_tag_camera) {
  reconstruct::Pose pose;
  pose.T_tag_camera = pose.T_tag_camera_raw = T_tag_camera;
  return pose;
}

/// Fuses all of a frame, also if that is more than the work of one call.
inline std::shared_ptr<const reconstruct::DistanceField> fuse_all(reconstruct::FusionStage& stage,
                                                                  const capture::FrameSet& frame,
                                                                  const reconstruct::Pose& pose) {
  std::shared_ptr<const reconstruct::DistanceField> before, field;
  do {
    before = field;
    field = stage.fuse(frame, pose);
  } while (field != before);
  return field;
}

/// Distance of the field's surface from the shape, by a ray through every third pixel; and the fraction of rays that
/// hit.
struct Agreement {
  double mean_m = 0, largest_m = 0, hit_fraction = 0, normal_deg = 0;
};
inline Agreement compare(const reconstruct::DistanceField& field, const Shape& shape,
                         const capture::CameraModel& camera, const Eigen::Isometry3d& T_tag_camera, int margin = 8) {
  Agreement result;
  int rays = 0, hits = 0;
  for (int v = margin; v < camera.height - margin; v += 3)
    for (int u = margin; u < camera.width - margin; u += 3) {
      const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      if (!ray) continue;
      const Eigen::Vector3d direction = T_tag_camera.linear() * *ray;
      const auto truth = march(shape, T_tag_camera.translation(), direction);
      // Beyond the depth limit and at very grazing angles no surface is required.
      if (!truth || *truth * ray->z() > 4.8 ||
          -direction.dot(normal_of(shape, T_tag_camera.translation() + *truth * direction)) < 0.2)
        continue;
      ++rays;
      const auto hit = field.raycast(T_tag_camera.translation().cast<float>(), direction.cast<float>(), 0.05f, 6);
      if (!hit) continue;
      ++hits;
      const Eigen::Vector3d p = hit->position_m.cast<double>();
      const double away = std::abs(shape(p));
      result.mean_m += away;
      result.largest_m = std::max(result.largest_m, away);
      Eigen::Vector3d normal;
      for (int i = 0; i < 3; ++i)
        normal[i] = shape(p + 1e-4 * Eigen::Vector3d::Unit(i)) - shape(p - 1e-4 * Eigen::Vector3d::Unit(i));
      const double cosine = std::min(1.0, normal.normalized().dot(hit->normal.cast<double>()));
      result.normal_deg += std::acos(cosine) / kDegree;
    }
  result.mean_m /= hits;
  result.normal_deg /= hits;
  result.hit_fraction = static_cast<double>(hits) / rays;
  return result;
}

}  // namespace lumigraft::test
