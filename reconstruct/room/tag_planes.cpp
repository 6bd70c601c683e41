#include "reconstruct/room/tag_planes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "reconstruct/math/median.h"
#include "reconstruct/room/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr auto& kPlanes = kRoomParameters.tag_planes;
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

Vector2f ray_at(const capture::CameraModel& camera, double u, double v) {
  const auto ray = camera.unproject({u, v});
  return ray && ray->z() > 0 ? Vector2f(ray->hnormalized().cast<float>()) : Vector2f(kUnknown, kUnknown);
}

/// Depth along a ray of a plane in the camera frame; 0 where it is behind the camera, too grazing or seen from behind.
float depth_on(const Isometry3f& T_camera_plane, const Vector2f& ray) {
  const Vector3f normal = T_camera_plane.linear().col(2);
  const float slope = normal.dot(ray.homogeneous());
  if (!(slope < -kPlanes.min_facing * ray.homogeneous().norm())) return 0;  // also NaN
  return std::max(normal.dot(T_camera_plane.translation()) / slope, 0.0f);
}

/// Red and blue relative to green: independent of how strong the light is.
Vector2f hue(const Vector3f& log_color) { return {log_color[0] - log_color[1], log_color[2] - log_color[1]}; }

/// Median and, in units of 1σ of a Gaussian, the median deviation from it.
struct Spread {
  float median, sigma;
};

Spread spread_of(std::vector<float> values) {
  const float middle = median(values);
  for (float& value : values) value = std::abs(value - middle);
  return {middle, 1.4826f * median(values)};
}

}  // namespace

TagPlanes::TagPlanes(const capture::Session& session)
    : camera_(session.color),
      block_px_(std::max(camera_.model.width / kPlanes.columns, 1)),
      columns_(camera_.model.width / block_px_),
      rows_(camera_.model.height / block_px_),
      awaited_(session.depth.has_value()) {
  const capture::CameraModel& model = camera_.model;
  for (int v = 0; v < model.height; ++v)
    for (int u = 0; u < model.width; ++u) rays_.push_back(ray_at(model, u, v));
  for (int y = 0; y < rows_; ++y)
    for (int x = 0; x < columns_; ++x)
      blocks_.push_back({Vector3f::Zero(), ray_at(model, (x + 0.5) * block_px_ - 0.5, (y + 0.5) * block_px_ - 0.5)});
  const capture::Tag& tag = session.tag;
  if (tag.present()) planes_.push_back({Eigen::Isometry3d::Identity(), static_cast<float>(tag.size_m)});
  for (const capture::ExtraTag& extra : tag.extra)
    if (extra.T_tag_extra) planes_.push_back({*extra.T_tag_extra, static_cast<float>(extra.size_m)});
}

capture::FrameSet TagPlanes::complete(const capture::FrameSet& frame, const std::optional<Pose>& pose) {
  const capture::CameraModel& model = camera_.model;
  if (!first_ns_ || frame.time_ns < *first_ns_) first_ns_ = frame.time_ns;
  awaited_ = awaited_ && frame.time_ns - *first_ns_ < kPlanes.awaited_ns;
  measured_ |= frame.depth != nullptr;
  const bool seen = pose && pose->age_ns == 0 && frame.color;
  if (measured_ || awaited_ || !seen) return frame;
  const auto fits = [&](const auto& image) { return image.width == model.width && image.height == model.height; };
  if (!fits(frame.color->encoded) && !fits(frame.color->radiance)) return frame;
  measure_colors(*frame.color);
  auto depth = std::make_shared<capture::DepthFrame>();
  depth->stamp = frame.color->stamp;
  depth->depth_m = capture::Image<float>(model.width, model.height, 1);
  for (const Plane& plane : planes_)
    add_depth(plane, (pose->T_tag_camera.inverse() * plane.T_tag_plane).cast<float>(), depth->depth_m);
  capture::FrameSet with = frame;
  with.depth = std::move(depth);
  return with;
}

std::vector<std::string> TagPlanes::warnings() const {
  if (measured_ || awaited_) return {};
  return {
      "no depth: only the surface around the tag is known; other real things hide no object, and cast and receive no "
      "shadows"};
}

void TagPlanes::measure_colors(const capture::Frame& color) {
  const bool coded = !color.encoded.empty();
  const auto exposure = static_cast<float>(camera_.exposure);
  for (int y = 0; y < rows_; ++y)
    for (int x = 0; x < columns_; ++x) {
      Vector3f sum = Vector3f::Zero();
      for (int v = y * block_px_; v < (y + 1) * block_px_; ++v)
        for (int u = x * block_px_; u < (x + 1) * block_px_; ++u)
          for (int c = 0; c < 3; ++c)
            sum[c] += coded ? camera_.response.to_linear(color.encoded.at(u, v, c), c)
                            : exposure * color.radiance.at(u, v, c);
      const auto pixels = static_cast<float>(block_px_ * block_px_);
      blocks_[static_cast<std::size_t>(y) * columns_ + x].log_color =
          (sum.array() / pixels).max(kPlanes.dark).log().matrix();
    }
}

/// Blocks that show the surface on which the tag lies.
std::vector<char> TagPlanes::surface_around(const Plane& plane, const Isometry3f& T_camera_plane) const {
  enum : char { elsewhere, near, around, on_tag };
  std::vector<char> where(blocks_.size(), elsewhere);
  std::vector<float> red, blue, steps;
  const Isometry3f T_plane_camera = T_camera_plane.inverse();
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const float z = depth_on(T_camera_plane, blocks_[i].ray);
    if (z <= 0) continue;
    const Vector2f at = (T_plane_camera * (z * blocks_[i].ray.homogeneous())).head<2>() / plane.size_m;
    const float square = at.lpNorm<Eigen::Infinity>();
    if (at.norm() < kPlanes.reach) where[i] = square < kPlanes.paper ? on_tag : square < kPlanes.around ? around : near;
    if (where[i] != around) continue;
    red.push_back(hue(blocks_[i].log_color)[0]);
    blue.push_back(hue(blocks_[i].log_color)[1]);
  }
  // Of a block and its neighbour `step` before it.
  const auto change = [&](std::size_t i, std::size_t step) {
    return std::abs((blocks_[i].log_color - blocks_[i - step].log_color).mean());
  };
  const auto row = static_cast<std::size_t>(columns_);
  for (std::size_t i = row + 1; i < blocks_.size(); ++i)
    for (const std::size_t step : {std::size_t{1}, row})
      if (where[i] == around && where[i - step] == around) steps.push_back(change(i, step));
  const Spread reds = spread_of(red), blues = spread_of(blue);
  const float edge = std::max(kPlanes.edge_sigmas * 1.4826f * median(steps), kPlanes.min_edge);
  const auto alike = [&](const Spread& spread, float value) {
    return std::abs(value - spread.median) <= std::max(kPlanes.hue_sigmas * spread.sigma, kPlanes.min_hue);
  };

  std::vector<char> found(blocks_.size(), 0);
  std::vector<std::size_t> front;
  const auto add = [&](std::size_t i) {
    const Vector2f of = hue(blocks_[i].log_color);
    if (found[i] || where[i] == elsewhere || !alike(reds, of[0]) || !alike(blues, of[1])) return;
    found[i] = 1;
    front.push_back(i);
  };
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (where[i] == around) add(i);
    if (where[i] == on_tag) found[i] = 1;
  }
  while (!front.empty()) {
    const std::size_t i = front.back();
    front.pop_back();
    const std::size_t x = i % row;
    if (x > 0 && change(i, 1) <= edge) add(i - 1);
    if (x + 1 < row && change(i + 1, 1) <= edge) add(i + 1);
    if (i >= row && change(i, row) <= edge) add(i - row);
    if (i + row < blocks_.size() && change(i + row, row) <= edge) add(i + row);
  }
  return found;
}

void TagPlanes::add_depth(const Plane& plane, const Isometry3f& T_camera_plane, capture::Image<float>& depth_m) const {
  const std::vector<char> found = surface_around(plane, T_camera_plane);
  for (int v = 0; v < rows_ * block_px_; ++v)
    for (int u = 0; u < columns_ * block_px_; ++u) {
      if (!found[static_cast<std::size_t>(v / block_px_) * columns_ + u / block_px_]) continue;
      float& nearest_m = depth_m.at(u, v);
      const float z = depth_on(T_camera_plane, rays_[depth_m.index(u, v)]);
      if (z > 0 && (nearest_m == 0 || z < nearest_m)) nearest_m = z;
    }
}

}  // namespace lumigraft::reconstruct
