#include "reconstruct/fusion_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumigraft {
namespace {

// Beyond this incidence two neighbouring pixels count as two surfaces, and a plane is not to be trusted.
constexpr float kSteepest = 5.0f;        // tan 79°
constexpr float kLeastFacing = 0.1f;     // cos 84°
constexpr double kLeastSigmaM = 0.0012;  // of the noise model, at 0.4 m
constexpr float kSurelyNoise = 4;        // σ
constexpr float kSurelyBent = 3;         // σ

/// What eq. 3 adds to eq. 2 beyond 10 degrees, over 0.0001 / √z.
double oblique(double incidence_rad) {
  if (incidence_rad <= M_PI / 18) return 0;
  const double rest = std::max(M_PI / 2 - incidence_rad, 1e-3);
  return incidence_rad * incidence_rad / (rest * rest);
}

/// σ of inverse depth.
float inverse_sigma(float q) {
  const float away = 1 - 0.4f * q;
  return static_cast<float>(kLeastSigmaM) * q * q + 0.0019f * away * away;
}

/// σ of the second difference of three blocks: a block's mean has half the noise of a pixel.
float bend_noise(float q) { return 0.5f * std::sqrt(6.0f) * inverse_sigma(q); }

}  // namespace

double depth_sigma_m(double depth_m, double incidence_rad) {
  const double away = depth_m - 0.4;
  return kLeastSigmaM + 0.0019 * away * away + 0.0001 / std::sqrt(depth_m) * oblique(incidence_rad);
}

float straight_sigma_m(float inverse_depth) {
  const float away = 1 / inverse_depth - 0.4f;
  return static_cast<float>(kLeastSigmaM) + 0.0019f * away * away;
}

PixelMap::PixelMap(const CameraModel& camera)
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

DepthPreparation::DepthPreparation(const CameraModel& camera, double voxel_m, double far_m)
    : width_(camera.width),
      height_(camera.height),
      blocks_x_(camera.width / 2),
      blocks_y_(camera.height / 2),
      focal_(static_cast<float>((camera.fx + camera.fy) / 2)),
      voxel_m_(static_cast<float>(voxel_m)),
      far_m_(static_cast<float>(far_m)) {
  for (std::size_t i = 0; i < oblique_.size(); ++i) {
    const double facing = std::min(1.0, (static_cast<double>(i) + 0.5) / kObliqueSteps);
    oblique_[i] = static_cast<float>(oblique(std::acos(facing)));
  }
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  const auto ray_at = [&](double u, double v) {
    const auto d = camera.unproject({u, v});
    return d && d->z() > 0 ? Eigen::Vector2f((d->head<2>() / d->z()).cast<float>()) : Eigen::Vector2f(kNaN, kNaN);
  };
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) rays_.push_back(ray_at(u, v));
  for (int v = 0; v < blocks_y_; ++v)
    for (int u = 0; u < blocks_x_; ++u) {
      const double x = 2 * u + 0.5, y = 2 * v + 0.5;
      BlockRay block;
      block.ray = ray_at(x, y);
      block.per_unit = {2 / (ray_at(x + 1, y) - ray_at(x - 1, y)).x(), 2 / (ray_at(x, y + 1) - ray_at(x, y - 1)).y()};
      block.inverse_length = 1 / std::sqrt(1 + block.ray.squaredNorm());
      block_rays_.push_back(block);
    }
}

/// On a plane 1/z is affine in the picture: in inverse depth q the slope of a surface inclined by θ is q tan θ / f per
/// pixel. A jump is more than the steepest of them and the sensor's noise.
float DepthPreparation::steepest(float q, float pixels) const {
  return q * pixels * (kSteepest / focal_) + kSurelyNoise * inverse_sigma(q);
}

void DepthPreparation::prepare(const Image<float>& depth_m, DepthView& view) {
  view.width = width_;
  view.height = height_;
  view.blocks_x = blocks_x_;
  view.blocks_y = blocks_y_;
  view.tiles_x = (width_ + DepthView::kTile - 1) / DepthView::kTile;
  view.tiles_y = (height_ + DepthView::kTile - 1) / DepthView::kTile;
  invert(depth_m, view);
  find_jumps(view);
  average_blocks(view);
  measure_noise(view);
  fit_planes(view);
  spread_jumps(view);
  measure_tiles(view);
}

void DepthPreparation::invert(const Image<float>& depth_m, DepthView& view) const {
  view.inverse_depth.resize(rays_.size());
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const float depth = depth_m.data[i];
    const bool seen = depth > 0 && depth <= far_m_ && rays_[i].x() == rays_[i].x();
    view.inverse_depth[i] = seen ? 1 / depth : 0;
  }
}

void DepthPreparation::find_jumps(DepthView& view) {
  rough_.assign(rays_.size(), 0);
  view.jumps.clear();
  block_jumps_.assign(static_cast<std::size_t>(blocks_x_) * blocks_y_, -1);
  for (int v = 0; v + 1 < height_; ++v) {
    const float* q = &view.inverse_depth[static_cast<std::size_t>(v) * width_];
    std::uint8_t* rough = &rough_[static_cast<std::size_t>(v) * width_];
    for (int u = 0; u + 1 < width_; ++u) {
      const float low = std::min(std::min(q[u], q[u + 1]), std::min(q[u + width_], q[u + width_ + 1]));
      const float high = std::max(std::max(q[u], q[u + 1]), std::max(q[u + width_], q[u + width_ + 1]));
      rough[u] = high - low > (low > 0 ? steepest(high, 1) : 0) ? 1 : 0;
    }
    for (int u = 0; u + 1 < width_; ++u)
      if (rough[u]) add_jump(view, u, v);
  }
}

void DepthPreparation::add_jump(DepthView& view, int u, int v) {
  std::int32_t& in_block = block_jumps_[static_cast<std::size_t>(std::min(v / 2, blocks_y_ - 1) * blocks_x_ +
                                                                 std::min(u / 2, blocks_x_ - 1))];
  if (in_block >= 0) return;  // one tells enough
  const std::int32_t first = view.pixel_index(u, v);
  const auto q = [&](std::int32_t pixel) { return view.inverse_depth[static_cast<std::size_t>(pixel)]; };
  DepthView::Jump jump;
  jump.near = jump.far = -1;
  for (const std::int32_t pixel : {first, first + 1, first + width_, first + width_ + 1}) {
    if (q(pixel) == 0) continue;
    if (jump.near < 0 || q(pixel) > q(jump.near)) jump.near = pixel;
    if (jump.far < 0 || q(pixel) < q(jump.far)) jump.far = pixel;
  }
  const float near = q(jump.near);
  // What is missing says nothing about what is behind.
  if (near - q(jump.far) <= steepest(near, 1)) jump.far = -1;
  jump.divide = jump.far < 0 ? 0 : (near + q(jump.far)) / 2;
  jump.pixel = Eigen::Vector2f(static_cast<float>(u) + 0.5f, static_cast<float>(v) + 0.5f);
  jump.voxel_pixels = voxel_m_ * focal_ * near;
  in_block = static_cast<std::int32_t>(view.jumps.size());
  view.jumps.push_back(jump);
}

void DepthPreparation::average_blocks(const DepthView& view) {
  block_inverse_.resize(static_cast<std::size_t>(blocks_x_) * blocks_y_);
  for (int v = 0; v < blocks_y_; ++v)
    for (int u = 0; u < blocks_x_; ++u) {
      const std::size_t i = static_cast<std::size_t>(2 * v) * width_ + 2 * u;
      const float* q = &view.inverse_depth[i];
      const float sum = q[0] + q[1] + q[width_] + q[width_ + 1];
      block_inverse_[static_cast<std::size_t>(v) * blocks_x_ + u] = rough_[i] ? 0 : 0.25f * sum;
    }
}

/// Per pixel, from the blocks to either side that are on the same surface; NaN where there is none. Where the surface
/// has a crease, which shows as more than `bend`, from the side that is straighter (as in ENO schemes, Harten et al.
/// 1987). `before` and `after` are how many blocks there are on either side.
float DepthPreparation::slope(const float* q, std::ptrdiff_t step, int before, int after, float bend) const {
  const float here = *q, most = steepest(here, 2);
  const bool back = before > 0 && q[-step] > 0 && std::abs(here - q[-step]) <= most;
  const bool ahead = after > 0 && q[step] > 0 && std::abs(q[step] - here) <= most;
  if (back && ahead) {
    const float bent = std::abs(q[step] - 2 * here + q[-step]);
    if (bent > bend && before > 1 && after > 1) {
      const float bent_back = q[-2 * step] > 0 ? std::abs(here - 2 * q[-step] + q[-2 * step]) : bent;
      const float bent_ahead = q[2 * step] > 0 ? std::abs(here - 2 * q[step] + q[2 * step]) : bent;
      if (std::min(bent_back, bent_ahead) < 0.5f * bent)
        return bent_back < bent_ahead ? 0.5f * (here - q[-step]) : 0.5f * (q[step] - here);
    }
    return 0.25f * (q[step] - q[-step]);
  }
  if (back) return 0.5f * (here - q[-step]);
  return ahead ? 0.5f * (q[step] - here) : std::numeric_limits<float>::quiet_NaN();
}

void DepthPreparation::fit_planes(DepthView& view) {
  view.blocks.assign(block_inverse_.size(), {});
  for (int v = 0; v < blocks_y_; ++v)
    for (int u = 0; u < blocks_x_; ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * blocks_x_ + u;
      const float q = block_inverse_[i];
      if (q == 0) continue;
      const float bend = kSurelyBent * view.noise_scale * bend_noise(q);
      const float by_u = slope(&block_inverse_[i], 1, u, blocks_x_ - 1 - u, bend);
      const float by_v = slope(&block_inverse_[i], blocks_x_, v, blocks_y_ - 1 - v, bend);
      // q = A x/z + B y/z + C, and (A, B, C) is the plane's normal over its distance.
      const BlockRay& ray = block_rays_[i];
      const float a = by_u * ray.per_unit.x(), b = by_v * ray.per_unit.y();
      const float c = q - a * ray.ray.x() - b * ray.ray.y();
      const float distance = 1 / std::sqrt(a * a + b * b + c * c);
      const float facing = std::min(q * distance * ray.inverse_length, 1.0f);
      if (!(facing >= kLeastFacing)) continue;  // slopes that are not known, too
      // depth_sigma_m(1 / q, acos(facing)), its angular part from the table.
      const float sigma =
          straight_sigma_m(q) + 0.0001f * std::sqrt(q) * oblique_[static_cast<std::size_t>(facing * kObliqueSteps)];
      DepthView::Block& block = view.blocks[i];
      block.normal = distance * Eigen::Vector3f(a, b, c);
      block.distance_m = distance;
      block.weight = static_cast<float>(kLeastSigmaM * kLeastSigmaM) / (sigma * sigma);
      block.facing = facing;
    }
}

/// Tells each block the closest jump, in two sweeps over neighbours (Danielsson 1980).
void DepthPreparation::spread_jumps(DepthView& view) {
  const auto adopt = [&](std::size_t i, int u, int v, std::int32_t candidate) {
    if (candidate < 0 || candidate == block_jumps_[i]) return;
    const Eigen::Vector2f here(2 * static_cast<float>(u) + 0.5f, 2 * static_cast<float>(v) + 0.5f);
    const DepthView::Jump& jump = view.jumps[static_cast<std::size_t>(candidate)];
    const float away = (jump.pixel - here).squaredNorm();
    const float reach = std::clamp(kJumpVoxels * jump.voxel_pixels, 2.0f, 48.0f);
    if (away > reach * reach) return;
    const std::int32_t own = block_jumps_[i];
    if (own < 0 || away < (view.jumps[static_cast<std::size_t>(own)].pixel - here).squaredNorm())
      block_jumps_[i] = candidate;
  };
  const std::ptrdiff_t row = blocks_x_;
  const auto visit = [&](int u, int v, int step) {
    const std::size_t i = static_cast<std::size_t>(v) * blocks_x_ + u;
    const std::int32_t* at = &block_jumps_[i];
    const bool before_u = step > 0 ? u > 0 : u + 1 < blocks_x_, after_u = step > 0 ? u + 1 < blocks_x_ : u > 0;
    const bool before_v = step > 0 ? v > 0 : v + 1 < blocks_y_;
    if (before_u) adopt(i, u, v, at[-step]);
    if (!before_v) return;
    adopt(i, u, v, at[-step * row]);
    if (before_u) adopt(i, u, v, at[-step * row - step]);
    if (after_u) adopt(i, u, v, at[-step * row + step]);
  };
  for (int v = 0; v < blocks_y_; ++v)
    for (int u = 0; u < blocks_x_; ++u) visit(u, v, 1);
  for (int v = blocks_y_ - 1; v >= 0; --v)
    for (int u = blocks_x_ - 1; u >= 0; --u) visit(u, v, -1);
  for (std::size_t i = 0; i < block_jumps_.size(); ++i) view.blocks[i].jump = block_jumps_[i];
}

/// Second differences along rows vanish on planes; their mean size over what the model says they would be.
void DepthPreparation::measure_noise(DepthView& view) const {
  double sum = 0;
  int count = 0;
  for (int v = 0; v < blocks_y_; v += 3)
    for (int u = 1; u + 1 < blocks_x_; u += 3) {
      const float* q = &block_inverse_[static_cast<std::size_t>(v) * blocks_x_ + u];
      if (q[-1] == 0 || q[0] == 0 || q[1] == 0 || std::abs(q[1] - q[-1]) > steepest(q[0], 4)) continue;
      // E|x| = 0.8 σ.
      sum += static_cast<double>(std::abs(q[-1] - 2 * q[0] + q[1]) / (0.8f * bend_noise(*q)));
      ++count;
    }
  view.noise_scale = count > 0 ? static_cast<float>(sum / count) : 0.0f;
}

void DepthPreparation::measure_tiles(DepthView& view) const {
  view.tiles.assign(static_cast<std::size_t>(view.tiles_x) * view.tiles_y, {});
  for (int y = 0; y < view.tiles_y; ++y)
    for (int x = 0; x < view.tiles_x; ++x) {
      const int end_u = std::min((x + 1) * DepthView::kTile, width_),
                end_v = std::min((y + 1) * DepthView::kTile, height_);
      float low = std::numeric_limits<float>::max(), high = 0;
      bool whole = true;
      for (int v = y * DepthView::kTile; v < end_v; ++v)
        for (int u = x * DepthView::kTile; u < end_u; ++u) {
          const float q = view.inverse_depth[static_cast<std::size_t>(v) * width_ + u];
          high = std::max(high, q);
          whole &= q > 0;
          low = std::min(low, q > 0 ? q : low);
        }
      DepthView::Tile& tile = view.tiles[static_cast<std::size_t>(y) * view.tiles_x + x];
      tile.whole = whole;
      if (high == 0) continue;
      tile.near_m = 1 / high;
      tile.far_m = 1 / low;
    }
}

}  // namespace lumigraft
