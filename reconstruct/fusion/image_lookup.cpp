#include "reconstruct/fusion/image_lookup.h"

#include <algorithm>

namespace lumigraft::reconstruct {

PixelMap::PixelMap(const capture::CameraModel& camera)
    : fx_(static_cast<float>(camera.fx)),
      fy_(static_cast<float>(camera.fy)),
      cx_(static_cast<float>(camera.cx)),
      cy_(static_cast<float>(camera.cy)),
      width_(camera.width + 2 * kMargin),
      height_(camera.height + 2 * kMargin) {
  if (std::all_of(camera.distortion.begin(), camera.distortion.end(), [](double k) { return k == 0; })) return;
  constexpr float kNowhere = -1e6f;
  table_.reserve(static_cast<std::size_t>(width_) * height_);
  for (int v = -kMargin; v < camera.height + kMargin; ++v)
    for (int u = -kMargin; u < camera.width + kMargin; ++u) {
      const auto pixel = camera.project({(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1});
      table_.push_back(pixel ? Eigen::Vector2f(pixel->cast<float>()) : Eigen::Vector2f(kNowhere, kNowhere));
    }
}

Eigen::Vector2f PixelMap::distorted(float u, float v) const {
  const float a = u + kMargin, b = v + kMargin;
  if (!(a >= 0 && b >= 0 && a < static_cast<float>(width_ - 1) && b < static_cast<float>(height_ - 1)))
    return {-1e6f, -1e6f};
  const int i = static_cast<int>(a), j = static_cast<int>(b);
  const float s = a - static_cast<float>(i), t = b - static_cast<float>(j);
  const Eigen::Vector2f* corner = &table_[static_cast<std::size_t>(j) * width_ + i];
  return (1 - t) * ((1 - s) * corner[0] + s * corner[1]) + t * ((1 - s) * corner[width_] + s * corner[width_ + 1]);
}

DepthReading DepthLookup::near_jump(const Eigen::Vector3f& p, int u, int v) const {
  const std::int32_t pixel = view_.pixel_index(u, v);
  const float inverse_depth = view_.inverse_depth[static_cast<std::size_t>(pixel)];
  if (inverse_depth == 0) return {};
  const PreparedDepth::Block& block = view_.block_of(u, v);
  const PreparedDepth::Jump& jump = view_.jumps[static_cast<std::size_t>(block.jump)];
  const bool near_side = inverse_depth > jump.divide;
  const float away_px2 = (jump.pixel - Eigen::Vector2f(static_cast<float>(u), static_cast<float>(v))).squaredNorm();
  const bool near_occlusion = away_px2 < jump.occlusion_px * jump.occlusion_px;
  // Deep behind the measurement nothing is observed, except the far surface that continues there.
  if (!(near_side && near_occlusion) &&
      (p.z() - kDepthLookup.behind_grazing * truncation_m_ - kDepthLookup.deep_voxels * voxel_m_) * inverse_depth >
          kDepthLookup.deep_ratio)
    return {};

  DepthReading reading;
  const PreparedDepth::Block* plane = block.weight > 0 ? &block : plane_block(u, v);
  if (plane) {
    float distance_m = plane->distance_m;
    if (plane != &block) distance_m = 0.5f * (distance_m + plane->normal.dot(surface(pixel)));
    reading = from_plane(p, *plane, distance_m);
    if (plane != &block) {
      reading.edge = true;
      reading.weight *= kDepthLookup.edge_weight;
    }
    // Behind its rim a surface is solid only where it is visible, or the field would grow fins along the line of sight.
    if (near_side && reading.weight > 0 && reading.distance_m < 0) {
      const float rim_px = kDepthLookup.rim_voxels * jump.voxel_pixels + 1;
      if ((away_px2 < rim_px * rim_px && reading.distance_m < -shell_m_) ||
          !visible_on_plane(p + reading.distance_m * plane->normal, jump, *plane, distance_m))
        reading.weight = 0;
    }
  }
  if (!near_occlusion) return reading;
  if (near_side) {
    if (reading.weight <= 0) return hidden_surface(p, block.jump);
  } else if (reading.weight > 0) {
    // In front of the far surface, but next to the rim of the near one.
    reading.distance_m = std::min(reading.distance_m, (p - jump.near_m).norm());
  }
  return reading;
}

/// Extrapolates a plane to a voxel just outside the image, since cells that the camera observes need it.
DepthReading DepthLookup::outside_image(const Eigen::Vector3f& p, const Eigen::Vector2f& pixel) const {
  const float last_u = static_cast<float>(view_.width - 1), last_v = static_cast<float>(view_.height - 1);
  if (p.z() > extrapolation_depth_m()) return {};
  const Eigen::Vector2f nearest(std::clamp(pixel.x(), 0.0f, last_u), std::clamp(pixel.y(), 0.0f, last_v));
  const float away_px = (pixel - nearest).cwiseAbs().maxCoeff();
  if (!(away_px < extrapolation_px())) return {};
  const int u = static_cast<int>(nearest.x() + 0.5f), v = static_cast<int>(nearest.y() + 0.5f);
  const float inverse_depth = view_.inverse_depth[static_cast<std::size_t>(view_.pixel_index(u, v))];
  const PreparedDepth::Block& block = view_.block_of(u, v);
  if (block.weight <= 0 || block.jump >= 0 || inverse_depth == 0 || !(inverse_depth * steady_depth_m_ > 1) ||
      away_px > kDepthLookup.rim_voxels * voxel_m_ * preprocessor_.focal() * inverse_depth + 1)
    return {};
  DepthReading reading = from_plane(p, block, block.distance_m);
  if (std::abs(reading.distance_m) > shell_m_) return {};
  reading.weight *= kDepthLookup.edge_weight;
  reading.visible = false;
  return reading;
}

/// Extrapolates the farther surface of a jump to a voxel just behind its rim, since cells that the camera observes need
/// it.
DepthReading DepthLookup::hidden_surface(const Eigen::Vector3f& p, std::int32_t jump) const {
  std::int32_t& at = view_.behind_cache[static_cast<std::size_t>(jump)];
  if (at == PreparedDepth::kNotCached) at = plane_behind(view_.jumps[static_cast<std::size_t>(jump)].far);
  if (at < 0) return {};
  const PreparedDepth::Block& plane = view_.blocks[static_cast<std::size_t>(at)];
  const float distance_m = plane.distance_m - plane.normal.dot(p);
  if (std::abs(distance_m) > shell_m_) return {};
  DepthReading reading;
  reading.distance_m = distance_m;
  reading.weight = kDepthLookup.edge_weight * plane.weight;
  reading.normal = plane.normal;
  reading.visible = false;
  return reading;
}

/// Index of the block whose plane may be extrapolated from a pixel; −1 = none.
std::int32_t DepthLookup::plane_behind(std::int32_t pixel) const {
  if (!(view_.inverse_depth[static_cast<std::size_t>(pixel)] * steady_depth_m_ > 1)) return -1;
  const int u = pixel % view_.width, v = pixel / view_.width;
  const PreparedDepth::Block& own = view_.block_of(u, v);
  const PreparedDepth::Block* plane = own.weight > 0 ? &own : plane_block(u, v);
  return plane ? static_cast<std::int32_t>(plane - view_.blocks.data()) : -1;
}

/// Whether the camera sees the plane at a point of it (camera frame), or within rim_slack_voxels towards its inside.
bool DepthLookup::visible_on_plane(const Eigen::Vector3f& foot, const PreparedDepth::Jump& jump,
                                   const PreparedDepth::Block& block, float distance_m) const {
  if (!(foot.z() > 0)) return false;
  const Eigen::Vector2f pixel = map_.pixel(foot.x() / foot.z(), foot.y() / foot.z());
  return visible_at(pixel, block, distance_m) ||
         visible_at(pixel + kDepthLookup.rim_slack_voxels * jump.voxel_pixels * jump.inside, block, distance_m);
}

bool DepthLookup::visible_at(const Eigen::Vector2f& pixel, const PreparedDepth::Block& block, float distance_m) const {
  const float x = pixel.x() + 0.5f, y = pixel.y() + 0.5f;
  // Outside the image nothing contradicts it.
  if (!(x >= 0 && y >= 0 && x < static_cast<float>(view_.width) && y < static_cast<float>(view_.height))) return true;
  const std::int32_t at = view_.pixel_index(static_cast<int>(x), static_cast<int>(y));
  const float inverse_depth = view_.inverse_depth[static_cast<std::size_t>(at)];
  if (inverse_depth == 0) return false;
  const float difference_m = block.normal.dot(surface(at)) - distance_m;
  return std::abs(difference_m) <
         0.5f * voxel_m_ + kDepthLookup.noise_sigmas * preprocessor_.noise().axial_sigma_m(1 / inverse_depth);
}

/// The block whose plane contains a pixel next to a jump, of the 3 × 3 blocks around; null for a pixel between
/// surfaces.
const PreparedDepth::Block* DepthLookup::plane_block(int u, int v) const {
  const std::int32_t pixel = view_.pixel_index(u, v);
  std::int32_t& found = view_.plane_cache[static_cast<std::size_t>(pixel)];
  if (found == PreparedDepth::kNotCached) {
    found = find_plane_block(u, v);
    view_.cached_pixels.push_back(pixel);
  }
  return found < 0 ? nullptr : &view_.blocks[static_cast<std::size_t>(found)];
}

/// Index of that block; −1 = none.
std::int32_t DepthLookup::find_plane_block(int u, int v) const {
  const std::int32_t pixel = view_.pixel_index(u, v);
  const float inverse_depth = view_.inverse_depth[static_cast<std::size_t>(pixel)];
  const Eigen::Vector3f ray = preprocessor_.ray(pixel).homogeneous();
  float min_difference = inverse_depth * (kDepthLookup.max_slope_change * 2 / preprocessor_.focal() +
                                          kDepthLookup.noise_sigmas *
                                              preprocessor_.noise().axial_sigma_m(1 / inverse_depth) * inverse_depth);
  std::int32_t best = -1;
  for (int y = std::max((v >> 1) - 1, 0); y <= std::min((v >> 1) + 1, view_.blocks_y - 1); ++y)
    for (int x = std::max((u >> 1) - 1, 0); x <= std::min((u >> 1) + 1, view_.blocks_x - 1); ++x) {
      const std::int32_t at = y * view_.blocks_x + x;
      const PreparedDepth::Block& block = view_.blocks[static_cast<std::size_t>(at)];
      if (block.weight <= 0) continue;
      const float difference = std::abs(block.normal.dot(ray) / block.distance_m - inverse_depth);
      if (difference >= min_difference) continue;
      min_difference = difference;
      best = at;
    }
  return best;
}

ColorLookup::ColorLookup(const capture::Frame* picture, const capture::Response& response, int width, int height,
                         const Eigen::Array3f& gain, const capture::Image<float>* vignetting) {
  if (!picture) return;
  if (!picture->radiance.empty() || vignetting) {
    radiance_ = capture::to_radiance(*picture, response);
    if (radiance_.radiance.width != width || radiance_.radiance.height != height) return;
    if (vignetting) capture::undo_vignetting(radiance_, *vignetting);
    for (std::size_t i = 0; i < radiance_.radiance.data.size(); ++i)
      radiance_.radiance.data[i] /= gain[static_cast<Eigen::Index>(i % 3)];
  } else {
    if (picture->encoded.width != width || picture->encoded.height != height || picture->encoded.channels != 3) return;
    pixels_ = picture->encoded.data.data();
    // Table of the radiance of each pixel value, from an image that contains all of them.
    capture::Frame all;
    all.exposure = picture->exposure;
    all.encoded = capture::Image<std::uint8_t>(256, 1, 3);
    for (std::size_t i = 0; i < all.encoded.data.size(); ++i) all.encoded.data[i] = static_cast<std::uint8_t>(i / 3);
    const capture::RadianceImage values = capture::to_radiance(all, response);
    for (int value = 0; value < 256; ++value)
      for (int c = 0; c < 3; ++c) {
        Simd4& entry = table_[static_cast<std::size_t>(c)][static_cast<std::size_t>(value)];
        entry[c] = values.radiance.at(value, 0, c) / gain[c];
        entry[3] = values.clipped.at(value, 0) != 0 ? static_cast<float>(1 << c) : 0;
      }
  }
  width_ = width;
  height_ = height;
}

}  // namespace lumigraft::reconstruct
