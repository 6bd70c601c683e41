#include "reconstruct/exposure/places.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "capture/camera/radiance.h"
#include "capture/camera/vignetting.h"
#include "reconstruct/exposure/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

CellKey key_of(const Vector3f& position_m, const Vector3f& normal) {
  const Eigen::Vector3i at = (position_m / kExposure.cell_m).array().floor().cast<int>();
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  CellKey key = 0;
  for (int i = 0; i < 3; ++i) key = key << 20 | (static_cast<CellKey>(at[i]) & 0xfffff);  // 10 km to either side
  return key << 3 | static_cast<CellKey>(2 * axis + (normal[axis] < 0 ? 1 : 0));
}

struct PixelRadiance {
  Array3f radiance = Array3f::Zero();
  bool dark = false;  ///< as of Place
};

/// Mean radiance of 3 × 3 pixels at gain 1; empty where one of them is clipped or outside.
std::optional<PixelRadiance> radiance_at(const capture::Frame& color, const capture::Response& response, int u, int v) {
  const bool linear = !color.radiance.empty();
  const int width = linear ? color.radiance.width : color.encoded.width;
  const int height = linear ? color.radiance.height : color.encoded.height;
  if (u < 1 || v < 1 || u + 1 >= width || v + 1 >= height) return std::nullopt;
  PixelRadiance result;
  for (int y = v - 1; y <= v + 1; ++y)
    for (int x = u - 1; x <= u + 1; ++x)
      for (int c = 0; c < 3; ++c) {
        if (linear) {
          const float value = color.radiance.at(x, y, c);
          if (!std::isfinite(value)) return std::nullopt;
          result.dark |= value <= 0;
          result.radiance[c] += std::max(value, std::numeric_limits<float>::min()) / 9;
          continue;
        }
        const std::uint8_t code = color.encoded.at(x, y, c);
        if (code >= capture::kFullScale) return std::nullopt;
        result.dark |= code < kExposure.min_code;
        const std::uint8_t bound = std::max(code, kExposure.min_code);
        result.radiance[c] += static_cast<float>(response.to_linear(bound, c) / color.exposure) / 9;
      }
  return result;
}

}  // namespace

PlaceSampler::PlaceSampler(const capture::ColorCamera& camera, const capture::DepthNoise& noise)
    : response_(camera.response),
      corner_rad_(static_cast<float>(capture::corner_angle_rad(camera.model))),
      sampler_(camera.model, noise) {}

std::vector<Place> PlaceSampler::places(const capture::FrameSet& frame, const Eigen::Isometry3f& T_tag_camera,
                                        const capture::Image<float>* vignetting) const {
  std::vector<Place> places;
  const DepthGrid grid = sampler_.sample(frame.depth->depth_m);
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.columns; ++c) {
      const DepthGrid::Point& point = grid.at(c, r);
      if (point.normal.isZero()) continue;
      const int u = grid.step * c + grid.step / 2, v = grid.step * r + grid.step / 2;
      auto seen = radiance_at(*frame.color, response_, u, v);
      if (!seen) continue;
      if (vignetting) seen->radiance *= vignetting->at(u, v);
      const float angle = std::atan2(point.position.head<2>().norm(), point.position.z()) / corner_rad_;
      const Vector3f position_m = T_tag_camera * point.position, normal = T_tag_camera.linear() * point.normal;
      places.push_back({key_of(position_m, normal), position_m, normal, seen->radiance, angle * angle, seen->dark});
    }
  return places;
}

std::vector<Vector3f> PlaceSampler::surface_m(const capture::DepthFrame& depth,
                                              const Eigen::Isometry3f& T_tag_camera) const {
  std::vector<Vector3f> points_m;
  for (const DepthGrid::Point& point : sampler_.sample(depth.depth_m).points)
    if (point.position.z() > 0) points_m.push_back(T_tag_camera * point.position);
  return points_m;
}

}  // namespace lumigraft::reconstruct
