#include "reconstruct/fusion_depth.h"

#include <algorithm>
#include <cmath>

namespace lumigraft {
namespace {

// Normals come from a plane fitted to the pixels within this radius: large enough that a depth step of 1 mm at 1 m
// tilts the plane by less than a degree.
constexpr int kNormalRadius_px = 4;
constexpr int kNormalStep_px = 2;
// Neighbours farther off in depth than this share of the depth lie on another surface (steep surfaces change by
// z/f · tan of the angle a pixel: 3 % over 4 pixels at f = 260 px is 63°).
constexpr float kSameSurface = 0.03f;
// Beside a depth edge a smaller window may still lie on one surface.
constexpr int kEdgeRadius_px = 2;
constexpr float kEdgeWeight = 0.2f;
constexpr float kEdgeFacing = 0.7f;  // of an edge nothing is known; a surface at 45 degrees stands for it
constexpr float kLeastFacing = 0.1f;
constexpr float kSigmaAt1m_m = 0.0019f;  // axial noise of a surface faced at 1 m: weight 1

/// Axial noise of a structured-light sensor (Nguyen, Izadi & Lovell 2012, "Modeling Kinect Sensor Noise", eq. 3):
/// z in metres, angle of incidence in radians.
float axial_sigma_m(float z_m, float angle_rad) {
  const float rest = 1.5707963f - angle_rad;
  return 0.0012f + 0.0019f * (z_m - 0.4f) * (z_m - 0.4f) +
         0.0001f / std::sqrt(z_m) * angle_rad * angle_rad / (rest * rest);
}

}  // namespace

DepthRays::DepthRays(const CameraModel& model)
    : model_(model),
      distorted_(model.kind != CameraModel::Kind::pinhole ||
                 std::any_of(model.distortion.begin(), model.distortion.end(), [](double k) { return k != 0; })),
      rays_(static_cast<std::size_t>(model.width) * model.height, Eigen::Vector3f::Zero()) {
  for (int v = 0; v < model.height; ++v) {
    for (int u = 0; u < model.width; ++u) {
      const auto ray = model.unproject({u, v});
      if (ray && ray->z() > 1e-6)
        rays_[static_cast<std::size_t>(v) * model.width + u] = (*ray / ray->z()).cast<float>();
    }
  }
}

std::optional<Eigen::Vector2f> DepthRays::pixel(const Eigen::Vector3f& p) const {
  if (p.z() <= 1e-3f) return std::nullopt;
  Eigen::Vector2f uv;
  if (distorted_) {
    const auto projected = model_.project(p.cast<double>());
    if (!projected) return std::nullopt;
    uv = projected->cast<float>();
  } else {
    const float inverse = 1.0f / p.z();
    uv << static_cast<float>(model_.fx) * p.x() * inverse + static_cast<float>(model_.cx),
        static_cast<float>(model_.fy) * p.y() * inverse + static_cast<float>(model_.cy);
  }
  if (!(uv.x() > -0.5f && uv.y() > -0.5f && uv.x() < static_cast<float>(model_.width) - 0.5f &&
        uv.y() < static_cast<float>(model_.height) - 0.5f)) {
    return std::nullopt;
  }
  return uv;
}

bool DepthRays::sees(const Eigen::Vector3f& c, float radius_m) const {
  if (distorted_ || c.z() <= 2 * radius_m) return true;
  const float z = c.z() - radius_m;
  const float reach_u = static_cast<float>(model_.fx) * radius_m / z,
              reach_v = static_cast<float>(model_.fy) * radius_m / z;
  const float u = static_cast<float>(model_.fx) * c.x() / c.z() + static_cast<float>(model_.cx);
  const float v = static_cast<float>(model_.fy) * c.y() / c.z() + static_cast<float>(model_.cy);
  // A sphere off the axis reaches a little farther outwards than its silhouette at the near side: doubled.
  return u > -2 * reach_u && v > -2 * reach_v && u < static_cast<float>(model_.width) + 2 * reach_u &&
         v < static_cast<float>(model_.height) + 2 * reach_v;
}

DepthMeasurement::DepthMeasurement(const Image<float>& depth_m, const DepthRays& rays, float far_m, float truncation_m)
    : depth_m_(depth_m),
      rays_(rays),
      far_m_(far_m),
      truncation_m_(truncation_m),
      normals_(depth_m.data.size(), Eigen::Vector3f::Zero()) {
  for (int v = 0; v < depth_m.height; ++v) {
    for (int u = 0; u < depth_m.width; ++u) {
      const float z = depth_m.at(u, v);
      if (z <= 0 || z > far_m) continue;
      Eigen::Vector3f& normal = normals_[depth_m.index(u, v)];
      normal = fit_normal(u, v, kNormalRadius_px, kNormalStep_px);
      if (normal.isZero()) normal = fit_normal(u, v, kEdgeRadius_px, 1);
    }
  }
}

Eigen::Vector3f DepthMeasurement::fit_normal(int u, int v, int radius, int step) const {
  if (u < radius || v < radius || u >= depth_m_.width - radius || v >= depth_m_.height - radius) {
    return Eigen::Vector3f::Zero();
  }
  // Inverse depth of a plane is linear in the picture: 1/z = n·ray/d with ray = ((u - cx)/fx, (v - cy)/fy, 1). A least
  // squares fit of 1/z over a window symmetric in u and v needs two sums alone.
  const float z = depth_m_.at(u, v);
  float slope_u = 0, slope_v = 0, square = 0, mean = 0, count = 0;
  for (int dv = -radius; dv <= radius; dv += step) {
    for (int du = -radius; du <= radius; du += step) {
      const float near = depth_m_.at(u + du, v + dv);
      const float farthest = kSameSurface * z * (1 + 0.25f * static_cast<float>(std::abs(du) + std::abs(dv)));
      if (near <= 0 || std::abs(near - z) > farthest) return Eigen::Vector3f::Zero();
      const float inverse = 1.0f / near;
      slope_u += static_cast<float>(du) * inverse;
      slope_v += static_cast<float>(dv) * inverse;
      square += static_cast<float>(du * du);
      mean += inverse;
      count += 1;
    }
  }
  // 1/z = a x + b y + c with x = (u - cx)/fx: the plane's normal is (a, b, c), turned towards the camera.
  const Eigen::Vector3f& ray = rays_.at(u, v);
  const float a = slope_u / square * static_cast<float>(rays_.model().fx);
  const float b = slope_v / square * static_cast<float>(rays_.model().fy);
  const float c = mean / count - a * ray.x() - b * ray.y();
  return -Eigen::Vector3f(a, b, c).normalized();
}

std::optional<DepthSeen> DepthMeasurement::along(const Eigen::Vector3f& p) const {
  const auto pixel = rays_.pixel(p);
  if (!pixel) return std::nullopt;
  const int u = static_cast<int>(std::lround(pixel->x())), v = static_cast<int>(std::lround(pixel->y()));
  float z = depth_m_.at(u, v);
  if (z <= 0 || z > far_m_) return std::nullopt;
  const Eigen::Vector3f& normal = normals_[depth_m_.index(u, v)];
  const Eigen::Vector3f& ray = rays_.at(u, v);
  const float length = ray.norm();
  if (normal.isZero()) {
    const float sigma = axial_sigma_m(z, std::acos(kEdgeFacing));
    const float weight = kEdgeWeight * kSigmaAt1m_m * kSigmaAt1m_m / (sigma * sigma);
    return DepthSeen{(z - p.z()) * length * kEdgeFacing, weight, kEdgeFacing, false, u, v};
  }
  const float facing = std::max(kLeastFacing, -normal.dot(ray) / length);
  // The point's own ray is not the pixel's: the plane through the pixel's surface point gives the distance.
  float distance = normal.dot(p - ray * z);
  // Far off the surface the plane says little about what lies between; along the ray it is free or hidden.
  if (std::abs(z - p.z()) > 4 * truncation_m_) distance = (z - p.z()) * length * facing;
  const float sigma = axial_sigma_m(z, std::acos(std::min(1.0f, facing)));
  return DepthSeen{distance, kSigmaAt1m_m * kSigmaAt1m_m / (sigma * sigma), facing, true, u, v};
}

}  // namespace lumigraft
