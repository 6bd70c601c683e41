#include "capture/sync/depth_registration.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumigraft::capture {
namespace {

constexpr int kNone = -1;
constexpr double kWidestPx = 32.0;  // bounds the cost of points very near the colour camera

/// Whether two depth pixels (by index) touch, corners included.
bool neighbours(int a, int b, int width) {
  return std::abs(a % width - b % width) <= 1 && std::abs(a / width - b / width) <= 1;
}

void fill_resampling_holes(Image<float>& depth_m, const std::vector<int>& origin, int origin_width) {
  const Image<float> before = depth_m;
  const auto fill = [&](int x, int y, int dx, int dy) {
    const int ax = x - dx, ay = y - dy;
    const int bx = x + dx, by = y + dy;
    if (ax < 0 || ay < 0 || bx >= before.width || by >= before.height) return false;
    const int a = origin[before.index(ax, ay)], b = origin[before.index(bx, by)];
    if (a == kNone || b == kNone || !neighbours(a, b, origin_width)) return false;
    depth_m.at(x, y) = 0.5f * (before.at(ax, ay) + before.at(bx, by));
    return true;
  };
  for (int y = 0; y < before.height; ++y) {
    for (int x = 0; x < before.width; ++x) {
      if (origin[before.index(x, y)] == kNone) fill(x, y, 1, 0) || fill(x, y, 0, 1) || fill(x, y, 1, 1);
    }
  }
}

}  // namespace

DepthRegistration::DepthRegistration(const DepthCamera& depth, const CameraModel& color)
    : depth_(depth), color_(color) {
  if (depth_.registered) return;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  rays_.reserve(static_cast<std::size_t>(depth_.model.width) * depth_.model.height);
  for (int v = 0; v < depth_.model.height; ++v) {
    for (int u = 0; u < depth_.model.width; ++u) {
      const auto ray = depth_.model.unproject({u, v});
      rays_.push_back(ray ? Eigen::Vector3d(*ray / ray->z()) : Eigen::Vector3d::Constant(nan));
    }
  }
}

Image<float> DepthRegistration::operator()(const Image<std::uint16_t>& counts) const {
  if (!depth_.registered) return reproject(counts);
  Image<float> depth_m(counts.width, counts.height, 1);
  std::transform(counts.data.begin(), counts.data.end(), depth_m.data.begin(),
                 [this](std::uint16_t count) { return static_cast<float>(count * depth_.unit_m); });
  return depth_m;
}

Image<float> DepthRegistration::reproject(const Image<std::uint16_t>& counts) const {
  Image<float> depth_m(color_.width, color_.height, 1);
  std::vector<int> origin(depth_m.data.size(), kNone);
  for (std::size_t i = 0; i < counts.data.size(); ++i) {
    if (counts.data[i] == 0 || std::isnan(rays_[i].x())) continue;
    const double z_depth = counts.data[i] * depth_.unit_m;
    const Eigen::Vector3d point = depth_.T_color_depth * Eigen::Vector3d(rays_[i] * z_depth);
    const auto pixel = color_.project(point);
    if (!pixel) continue;
    // The pixel's width in the colour image, so that neighbours touch without overlap.
    const double half_x = 0.5 * std::clamp(color_.fx * z_depth / (depth_.model.fx * point.z()), 1.0, kWidestPx);
    const double half_y = 0.5 * std::clamp(color_.fy * z_depth / (depth_.model.fy * point.z()), 1.0, kWidestPx);
    const int x0 = static_cast<int>(std::clamp(std::ceil(pixel->x() - half_x), 0.0, 1.0 * color_.width));
    const int x1 = static_cast<int>(std::clamp(std::ceil(pixel->x() + half_x), 0.0, 1.0 * color_.width));
    const int y0 = static_cast<int>(std::clamp(std::ceil(pixel->y() - half_y), 0.0, 1.0 * color_.height));
    const int y1 = static_cast<int>(std::clamp(std::ceil(pixel->y() + half_y), 0.0, 1.0 * color_.height));
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const std::size_t at = depth_m.index(x, y);
        if (origin[at] == kNone || point.z() < depth_m.data[at]) {
          depth_m.data[at] = static_cast<float>(point.z());
          origin[at] = static_cast<int>(i);
        }
      }
    }
  }
  fill_resampling_holes(depth_m, origin, depth_.model.width);
  return depth_m;
}

RegistrationStage::RegistrationStage(const Session& session) {
  if (session.depth) registration_.emplace(*session.depth, session.color.model);
}

FrameSet RegistrationStage::register_depth(const FrameSet& frame) {
  FrameSet with = frame;
  if (!registration_ || !frame.raw_depth) return with;
  if (frame.raw_depth != last_raw_) {
    auto depth = std::make_shared<DepthFrame>();
    depth->stamp = frame.raw_depth->stamp;
    depth->depth_m = (*registration_)(frame.raw_depth->counts);
    last_ = std::move(depth);
    last_raw_ = frame.raw_depth;
  }
  with.depth = last_;
  return with;
}

std::optional<FrameSet> RegisteredFrames::next(std::chrono::milliseconds timeout) {
  const std::optional<FrameSet> frame = reader_->next(timeout);
  return frame ? std::optional(stage_.register_depth(*frame)) : std::nullopt;
}

}  // namespace lumigraft::capture
