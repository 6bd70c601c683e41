#include "reconstruct/fusion/depth_preprocess.h"

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <limits>

#include "reconstruct/fusion/parameters.h"
#include "reconstruct/fusion/steep_plane.h"
#include "reconstruct/math/depth_noise.h"
#include "reconstruct/math/simd8.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kMinVariance = static_cast<float>(kMinDepthSigma_m * kMinDepthSigma_m);
constexpr int kSlopeBlocks = 2;        // blocks to either side that `slope` may read
constexpr float kToCorner_px = 0.75f;  // from the centre of a block to a pixel's, rounded up

/// 1σ of the second difference of three blocks' inverse depth q: a block's mean has half the noise of a pixel.
template <typename Value>
[[gnu::always_inline]] inline Value second_difference_sigma(Value q, const capture::DepthNoise& noise) {
  constexpr float kRoot6 = 2.44948974f;
  return 0.5f * kRoot6 * noise.inverse_sigma(q);
}

/// Depth behind which a plane observes nothing: beyond the truncation distance from it, or so far along the ray.
/// `low_q`: the smallest inverse depth of the block.
template <typename Value>
[[gnu::always_inline]] inline Value hidden_behind_plane_m(Value low_q, Value plane_m, float truncation_m) {
  const Value along_ray = truncation_m / (plane_m * low_q), max = kDepthLookup.behind_grazing * truncation_m + Value{};
  return 1 / low_q + (along_ray < max ? along_ray : max);
}

/// Largest difference of inverse depth q over so many pixels on one surface; a jump exceeds it. On a plane 1/z is
/// affine in the image: a surface inclined by θ has the slope q tan θ / f per pixel. Includes the sensor's noise.
template <typename Value>
[[gnu::always_inline]] inline Value max_surface_step(Value q, float pixels, float focal,
                                                     const capture::DepthNoise& noise) {
  return q * (pixels * kDepthPreprocess.max_slope / focal) + kDepthPreprocess.jump_sigmas * noise.inverse_sigma(q);
}

}  // namespace

DepthPreprocessor::DepthPreprocessor(const capture::CameraModel& camera, double voxel_m, double truncation_m,
                                     double far_m, bool wide, const capture::DepthNoise& noise)
    : width_(camera.width),
      height_(camera.height),
      blocks_x_(camera.width / 2),
      blocks_y_(camera.height / 2),
      focal_(static_cast<float>((camera.fx + camera.fy) / 2)),
      voxel_m_(static_cast<float>(voxel_m)),
      truncation_m_(static_cast<float>(truncation_m)),
      far_m_(static_cast<float>(far_m)),
      noise_(noise),
      wide_(wide && simd8_supported()) {
  for (std::size_t i = 0; i < oblique_.size(); ++i) {
    const double facing = std::min(1.0, (static_cast<double>(i) + 0.5) / kObliqueSteps);
    oblique_[i] = static_cast<float>(noise.oblique_m * capture::DepthNoise::oblique(std::acos(facing)));
  }
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  const auto ray_at = [&](double u, double v) {
    const auto d = camera.unproject({u, v});
    return d && d->z() > 0 ? Eigen::Vector2f((d->head<2>() / d->z()).cast<float>()) : Eigen::Vector2f(kNaN, kNaN);
  };
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      const Eigen::Vector2f ray = ray_at(u, v);
      if (std::isnan(ray.x())) no_ray_.push_back(static_cast<std::uint32_t>(rays_.size()));
      rays_.push_back(ray);
    }
  for (int v = 0; v < blocks_y_; ++v)
    for (int u = 0; u < blocks_x_; ++u) {
      const double x = 2 * u + 0.5, y = 2 * v + 0.5;
      const Eigen::Vector2f ray = ray_at(x, y);
      block_rays_.x.push_back(ray.x());
      block_rays_.y.push_back(ray.y());
      block_rays_.per_x.push_back(2 / (ray_at(x + 1, y) - ray_at(x - 1, y)).x());
      block_rays_.per_y.push_back(2 / (ray_at(x, y + 1) - ray_at(x, y - 1)).y());
      block_rays_.inverse_length.push_back(1 / std::sqrt(1 + ray.squaredNorm()));
    }
}

void DepthPreprocessor::prepare(const capture::Image<float>& depth_m, PreparedDepth& view) {
  view.width = width_;
  view.height = height_;
  view.blocks_x = blocks_x_;
  view.blocks_y = blocks_y_;
  view.tiles_x = (width_ + PreparedDepth::kTile - 1) / PreparedDepth::kTile;
  view.tiles_y = (height_ + PreparedDepth::kTile - 1) / PreparedDepth::kTile;
  view.clear_plane_cache();
  view.plane_cache.resize(rays_.size(), PreparedDepth::kNotCached);
  view.inverse_depth.resize(rays_.size());
  view.tiles.assign(static_cast<std::size_t>(view.tiles_x) * view.tiles_y, {});
  view.jumps.clear();
  jump_reach_.clear();
  discontinuous_.resize(rays_.size());
  block_inverse_.resize(static_cast<std::size_t>(blocks_x_) * blocks_y_);
  block_jumps_.resize(block_inverse_.size());
  block_hidden_m_.resize(block_inverse_.size());
  // One row of tiles at a time, so that it stays in the cache.
  for (int y = 0; y < view.tiles_y; ++y) {
    const int v = y * PreparedDepth::kTile, end = std::min(v + PreparedDepth::kTile, height_);
    invert(depth_m, view, v, end);
    find_jumps(view, v, end);
    average_blocks(view, v / 2, end / 2);
    measure_tiles(view, y);
  }
  measure_noise(view);
  accept_steep_planes(view);
  wide_ ? fit_planes_wide(view) : fit_planes(view);
  set_steep_planes(view);
  spread_jumps(view);
  measure_hidden(view);
  view.behind_cache.assign(view.jumps.size(), PreparedDepth::kNotCached);
}

void DepthPreprocessor::invert(const capture::Image<float>& depth_m, PreparedDepth& view, int first_v,
                               int end_v) const {
  const std::size_t first = static_cast<std::size_t>(first_v) * width_, end = static_cast<std::size_t>(end_v) * width_;
  std::size_t i = first;
  for (; i + 4 <= end; i += 4) {
    const Simd4 depth = load(&depth_m.data[i]);
    store(&view.inverse_depth[i], select((depth > 0) & (depth <= far_m_), 1 / depth, Simd4{}));
  }
  for (; i < end; ++i) {
    const float depth = depth_m.data[i];
    view.inverse_depth[i] = depth > 0 && depth <= far_m_ ? 1 / depth : 0;
  }
  for (auto pixel = std::lower_bound(no_ray_.begin(), no_ray_.end(), first); pixel != no_ray_.end() && *pixel < end;
       ++pixel)
    view.inverse_depth[*pixel] = 0;
}

/// Starts one row earlier, since that row is compared with the first of these.
void DepthPreprocessor::find_jumps(PreparedDepth& view, int first_v, int end_v) {
  std::fill(discontinuous_.begin() + std::ptrdiff_t{first_v} * width_,
            discontinuous_.begin() + std::ptrdiff_t{end_v} * width_, std::uint8_t{0});
  std::fill(block_jumps_.begin() + std::ptrdiff_t{first_v / 2} * blocks_x_,
            block_jumps_.begin() + std::ptrdiff_t{end_v / 2} * blocks_x_, -1);
  const auto differ = [&]<typename Value>(Value a, Value b, Value c, Value d, const Value& none) {
    const Value low_ab = a < b ? a : b, low_cd = c < d ? c : d, high_ab = a > b ? a : b, high_cd = c > d ? c : d;
    const Value low = low_ab < low_cd ? low_ab : low_cd, high = high_ab > high_cd ? high_ab : high_cd;
    // A missing measurement next to a valid one counts as a jump.
    return high - low > (low > 0 ? max_surface_step(high, 1, focal_, noise_) : none);
  };
  for (int v = std::max(first_v - 1, 0); v + 1 < end_v; ++v) {
    const float* q = &view.inverse_depth[static_cast<std::size_t>(v) * width_];
    int u = 0;
    for (; u + 5 <= width_; u += 4) {
      const Simd4Int jumps =
          differ(load(q + u), load(q + u + 1), load(q + u + width_), load(q + u + width_ + 1), Simd4{});
      if (!any(jumps)) continue;
      for (int k = 0; k < 4; ++k) {
        if (jumps[k]) add_jump(view, u + k, v);
      }
    }
    for (; u + 1 < width_; ++u) {
      if (differ(q[u], q[u + 1], q[u + width_], q[u + width_ + 1], 0.0f)) add_jump(view, u, v);
    }
  }
}

void DepthPreprocessor::add_jump(PreparedDepth& view, int u, int v) {
  discontinuous_[static_cast<std::size_t>(v) * width_ + u] = 1;
  std::int32_t& in_block = block_jumps_[static_cast<std::size_t>(std::min(v / 2, blocks_y_ - 1) * blocks_x_ +
                                                                 std::min(u / 2, blocks_x_ - 1))];
  if (in_block >= 0) return;  // one jump per block is enough
  const std::int32_t first = view.pixel_index(u, v);
  const auto q = [&](std::int32_t pixel) { return view.inverse_depth[static_cast<std::size_t>(pixel)]; };
  PreparedDepth::Jump jump;
  jump.near = jump.far = -1;
  for (const std::int32_t pixel : {first, first + 1, first + width_, first + width_ + 1}) {
    if (q(pixel) == 0) continue;
    if (jump.near < 0 || q(pixel) > q(jump.near)) jump.near = pixel;
    if (jump.far < 0 || q(pixel) < q(jump.far)) jump.far = pixel;
  }
  const float near = q(jump.near);
  // A missing measurement says nothing about the surface behind.
  if (near - q(jump.far) <= max_surface_step(near, 1, focal_, noise_)) jump.far = -1;
  jump.divide = jump.far < 0 ? 0 : (near + q(jump.far)) / 2;
  jump.pixel = Eigen::Vector2f(static_cast<float>(u) + 0.5f, static_cast<float>(v) + 0.5f);
  jump.voxel_pixels = voxel_m_ * focal_ * near;
  jump.near_m = ray(jump.near).homogeneous() / near;
  jump.inside =
      (Eigen::Vector2f(static_cast<float>(jump.near % width_), static_cast<float>(jump.near / width_)) - jump.pixel)
          .normalized();
  if (jump.far >= 0) jump.occlusion_px = kDepthLookup.occlusion_voxels * jump.voxel_pixels + 1;
  in_block = static_cast<std::int32_t>(view.jumps.size());
  view.jumps.push_back(jump);
  const float reach_px = std::clamp(kDepthPreprocess.jump_reach_voxels * jump.voxel_pixels,
                                    kDepthPreprocess.min_jump_reach_px, kDepthPreprocess.max_jump_reach_px);
  jump_reach_.push_back(Simd4{jump.pixel.x(), jump.pixel.y(), reach_px * reach_px, 0});
}

/// Jumps that are steep planes are none.
void DepthPreprocessor::accept_steep_planes(PreparedDepth& view) {
  steep_.clear();
  std::size_t kept = 0;
  for (std::size_t k = 0; k < view.jumps.size(); ++k) {
    const auto x = static_cast<int>(view.jumps[k].pixel.x()), y = static_cast<int>(view.jumps[k].pixel.y());
    const int u = std::min(x / 2, blocks_x_ - 1), v = std::min(y / 2, blocks_y_ - 1);
    const std::size_t i = static_cast<std::size_t>(v) * blocks_x_ + u;
    if (view.jumps[k].far >= 0)
      if (const auto plane = steep_plane_at(view, 2 * u, 2 * v, focal_, noise_)) {
        steep_.emplace_back(i, *plane);
        block_jumps_[i] = -1;
        block_inverse_[i] = plane->inverse_depth;
        continue;
      }
    block_jumps_[i] = static_cast<std::int32_t>(kept);
    view.jumps[kept] = view.jumps[k];
    jump_reach_[kept++] = jump_reach_[k];
  }
  view.jumps.resize(kept);
  jump_reach_.resize(kept);
}

void DepthPreprocessor::set_steep_planes(PreparedDepth& view) {
  for (const auto& [i, plane] : steep_) set_plane(view, i, plane.inverse_depth, plane.by_u, plane.by_v);
}

void DepthPreprocessor::average_blocks(const PreparedDepth& view, int first_v, int end_v) {
  for (int v = first_v; v < end_v; ++v)
    for (int u = 0; u < blocks_x_; ++u) {
      const std::size_t i = static_cast<std::size_t>(2 * v) * width_ + 2 * u;
      const float* q = &view.inverse_depth[i];
      const float sum = q[0] + q[1] + q[width_] + q[width_ + 1];
      block_inverse_[static_cast<std::size_t>(v) * blocks_x_ + u] = discontinuous_[i] ? 0 : 0.25f * sum;
    }
}

/// Slope of inverse depth per pixel, from the blocks to either side that are on the same surface; NaN if none is. At a
/// crease, where the second difference exceeds `bend`, from the straighter side (as in ENO schemes, Harten et al.
/// 1987). `before` and `after`: number of blocks in the image to either side.
float DepthPreprocessor::slope(const float* q, std::ptrdiff_t step, int before, int after, float bend) const {
  const float here = *q, max_step = max_surface_step(here, 2, focal_, noise_);
  const bool back = before > 0 && q[-step] > 0 && std::abs(here - q[-step]) <= max_step;
  const bool ahead = after > 0 && q[step] > 0 && std::abs(q[step] - here) <= max_step;
  if (back && ahead) {
    const float bent = std::abs(q[step] - 2 * here + q[-step]);
    if (bent > bend && before > 1 && after > 1) {
      const float bent_back = q[-2 * step] > 0 ? std::abs(here - 2 * q[-step] + q[-2 * step]) : bent;
      const float bent_ahead = q[2 * step] > 0 ? std::abs(here - 2 * q[step] + q[2 * step]) : bent;
      if (std::min(bent_back, bent_ahead) < kDepthPreprocess.crease_ratio * bent)
        return bent_back < bent_ahead ? 0.5f * (here - q[-step]) : 0.5f * (q[step] - here);
    }
    return 0.25f * (q[step] - q[-step]);
  }
  if (back) return 0.5f * (here - q[-step]);
  return ahead ? 0.5f * (q[step] - here) : std::numeric_limits<float>::quiet_NaN();
}

LUMIGRAFT_SIMD8_TARGET void DepthPreprocessor::fit_planes_wide(PreparedDepth& view) { fit_planes(view); }

[[gnu::always_inline]] inline void DepthPreprocessor::fit_planes(PreparedDepth& view) {
  view.blocks.resize(block_inverse_.size());
  view.planes.resize(block_inverse_.size());
  view.plane_weights.resize(block_inverse_.size());
  view.jump_depth_m.resize(block_inverse_.size());
  for (int v = 0; v < blocks_y_; ++v) {
    const bool inside = v >= kSlopeBlocks && v + kSlopeBlocks < blocks_y_;
    int u = 0;
    while (u < blocks_x_) {
      if (inside && u >= kSlopeBlocks && u + 8 + kSlopeBlocks <= blocks_x_) {
        fit_eight_planes(view, u, v);
        u += 8;
      } else {
        fit_plane(view, u++, v);
      }
    }
  }
}

void DepthPreprocessor::fit_plane(PreparedDepth& view, int u, int v) {
  const std::size_t i = static_cast<std::size_t>(v) * blocks_x_ + u;
  view.blocks[i] = {};
  view.planes[i] = Simd4{};
  view.plane_weights[i] = 0;
  block_hidden_m_[i] = 0;
  const float q = block_inverse_[i];
  if (q == 0) return;
  const float bend = kDepthPreprocess.crease_sigmas * view.noise_scale * second_difference_sigma(q, noise_);
  const float by_u = slope(&block_inverse_[i], 1, u, blocks_x_ - 1 - u, bend);
  const float by_v = slope(&block_inverse_[i], blocks_x_, v, blocks_y_ - 1 - v, bend);
  set_plane(view, i, q, by_u, by_v);
}

/// Unless it is too grazing.
void DepthPreprocessor::set_plane(PreparedDepth& view, std::size_t i, float q, float by_u, float by_v) {
  // q = a x/z + b y/z + c, where (a, b, c) is the plane's normal divided by its distance.
  const float a = by_u * block_rays_.per_x[i], b = by_v * block_rays_.per_y[i];
  const float c = q - a * block_rays_.x[i] - b * block_rays_.y[i];
  const float distance = 1 / std::sqrt(a * a + b * b + c * c);
  const float facing = std::min(q * distance * block_rays_.inverse_length[i], 1.0f);
  if (!(facing >= kDepthPreprocess.min_facing)) return;  // also for unknown slopes (NaN)
  PreparedDepth::Block& block = view.blocks[i];
  // DepthNoise::sigma_m(1 / q, acos(facing)) with the angular term from the table.
  const float root = std::sqrt(q), grown = noise_.oblique_grows ? 1 / (q * root) : root;
  const float sigma = noise_.axial_sigma_m(1 / q) + grown * oblique_[static_cast<std::size_t>(facing * kObliqueSteps)];
  block.normal = distance * Eigen::Vector3f(a, b, c);
  block.distance_m = distance;
  block.weight = std::min(kMinVariance / (sigma * sigma), 1.0f);
  block.facing = facing;
  view.planes[i] = Simd4{a, b, c, distance};
  view.plane_weights[i] = block.weight;
  const float low_q = std::max(q - kToCorner_px * (std::abs(by_u) + std::abs(by_v)), 0.5f * q);
  block_hidden_m_[i] = hidden_behind_plane_m(low_q, distance, truncation_m_);
}

/// fit_plane for eight blocks in a row that have kSlopeBlocks more on every side.
[[gnu::always_inline]] inline void DepthPreprocessor::fit_eight_planes(PreparedDepth& view, int u, int v) {
  const std::size_t i = static_cast<std::size_t>(v) * blocks_x_ + u;
  const Simd8 q = load8(&block_inverse_[i]);
  const Simd8 bend = kDepthPreprocess.crease_sigmas * view.noise_scale * second_difference_sigma(q, noise_);
  const Simd8 max_step = max_surface_step(q, 2, focal_, noise_);
  // `slope` for eight blocks, along u or v.
  const auto slopes = [&](std::ptrdiff_t step) __attribute__((always_inline)) {
    const Simd8 back = load8(&block_inverse_[i] - step), ahead = load8(&block_inverse_[i] + step);
    const Simd8Int with_back = (back > 0) & (abs(q - back) <= max_step);
    const Simd8Int with_ahead = (ahead > 0) & (abs(ahead - q) <= max_step);
    const Simd8 one_side = select(with_back, 0.5f * (q - back), 0.5f * (ahead - q));
    Simd8 found = select(with_back & with_ahead, 0.25f * (ahead - back), one_side);
    found = select(with_back | with_ahead, found, broadcast8(std::numeric_limits<float>::quiet_NaN()));
    unsigned bent = lane_mask(with_back & with_ahead & (abs(ahead - 2 * q + back) > bend));
    for (; bent != 0; bent &= bent - 1) {
      const int k = std::countr_zero(bent);
      found[k] = slope(&block_inverse_[i] + k, step, kSlopeBlocks, kSlopeBlocks, bend[k]);
    }
    return found;
  };
  const Simd8 by_u = slopes(1), by_v = slopes(blocks_x_);
  Simd8 a = by_u * load8(&block_rays_.per_x[i]);
  Simd8 b = by_v * load8(&block_rays_.per_y[i]);
  Simd8 c = q - a * load8(&block_rays_.x[i]) - b * load8(&block_rays_.y[i]);
  Simd8 distance = 1 / sqrt(a * a + b * b + c * c);
  const Simd8 facing =
      min(broadcast8(1), q * distance * load8(&block_rays_.inverse_length[i]));  // this order of operands keeps a NaN
  const Simd8Int known = (q > 0) & (facing >= kDepthPreprocess.min_facing);
  const Simd8Int step = __builtin_convertvector(select(known, facing, Simd8{}) * kObliqueSteps, Simd8Int);
  const auto oblique_at = [&](int lane) { return oblique_[static_cast<std::size_t>(step[lane])]; };
  const Simd8 oblique = {oblique_at(0), oblique_at(1), oblique_at(2), oblique_at(3),
                         oblique_at(4), oblique_at(5), oblique_at(6), oblique_at(7)};
  const Simd8 root = sqrt(q), grown = noise_.oblique_grows ? 1 / (q * root) : root;
  const Simd8 sigma = noise_.axial_sigma_m(1 / q) + grown * oblique;
  const Simd8 weights = select(known, min(kMinVariance / (sigma * sigma), broadcast8(1)), Simd8{});
  store(&view.plane_weights[i], weights);
  const Simd8 facings = select(known, facing, Simd8{});
  const Simd8 low_q = max(q - kToCorner_px * (abs(by_u) + abs(by_v)), 0.5f * q);
  store(&block_hidden_m_[i], select(known, hidden_behind_plane_m(low_q, distance, truncation_m_), Simd8{}));
  a = select(known, a, Simd8{});
  b = select(known, b, Simd8{});
  c = select(known, c, Simd8{});
  distance = select(known, distance, Simd8{});
  const Simd8 x = distance * a, y = distance * b, z = distance * c;
  const auto write = [&](std::size_t from, auto half_of) __attribute__((always_inline)) {
    Simd4 normal[4] = {half_of(x), half_of(y), half_of(z), half_of(distance)};
    transpose(normal[0], normal[1], normal[2], normal[3]);
    Simd4 planes[4] = {half_of(a), half_of(b), half_of(c), half_of(distance)};
    transpose(planes[0], planes[1], planes[2], planes[3]);
    const Simd4 four_weights = half_of(weights), four_facings = half_of(facings);
    for (std::size_t k = 0; k < 4; ++k) {
      view.planes[from + k] = planes[k];
      PreparedDepth::Block& block = view.blocks[from + k];
      block.normal = {normal[k][0], normal[k][1], normal[k][2]};
      block.distance_m = normal[k][3];
      block.weight = four_weights[k];
      block.facing = four_facings[k];
      block.jump = -1;
    }
  };
  write(
      i, [](Simd8 of) __attribute__((always_inline)) { return low_half(of); });
  write(
      i + 4, [](Simd8 of) __attribute__((always_inline)) { return high_half(of); });
}

/// Propagates the closest jump to each block in two sweeps over neighbours (Danielsson 1980).
void DepthPreprocessor::spread_jumps(PreparedDepth& view) {
  const auto adopt = [&](std::size_t i, int u, int v, std::int32_t candidate) {
    if (candidate < 0 || candidate == block_jumps_[i]) return;
    const Eigen::Vector2f here(2 * static_cast<float>(u) + 0.5f, 2 * static_cast<float>(v) + 0.5f);
    const auto away_from = [&](const Simd4& jump) { return (Eigen::Vector2f(jump[0], jump[1]) - here).squaredNorm(); };
    const Simd4& jump = jump_reach_[static_cast<std::size_t>(candidate)];
    const float away = away_from(jump);
    if (away > jump[2]) return;
    const std::int32_t own = block_jumps_[i];
    if (own < 0 || away < away_from(jump_reach_[static_cast<std::size_t>(own)])) block_jumps_[i] = candidate;
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
  // Most blocks are far from jumps: groups of eight without a jump next to them or before them in the row are skipped.
  const auto sweep = [&](int v, int step) {
    const std::int32_t* own = &block_jumps_[static_cast<std::size_t>(v) * blocks_x_];
    const bool before_v = step > 0 ? v > 0 : v + 1 < blocks_y_;
    const std::int32_t* before = before_v ? own - step * row : own;
    const int end = step > 0 ? blocks_x_ : -1;
    for (int u = step > 0 ? 0 : blocks_x_ - 1; u != end;) {
      const int next = u + 8 * step;
      if (next * step <= end * step && std::min(u, next - step) > 0 && std::max(u, next - step) + 1 < blocks_x_) {
        const int low = std::min(u, next - step) - 1;
        bool none = true;
        for (int k = 0; k < 10; ++k) none &= (own[low + k] & before[low + k]) < 0;
        if (none) {
          u = next;
          continue;
        }
      }
      visit(u, v, step);
      u += step;
    }
  };
  for (int v = 0; v < blocks_y_; ++v) sweep(v, 1);
  for (int v = blocks_y_ - 1; v >= 0; --v) sweep(v, -1);
  for (int v = 0; v < blocks_y_; ++v)
    for (int u = 0; u < blocks_x_; ++u) mark_jump(view, u, v);
}

/// Assigns the jump of a block to it, and what PreparedDepth::plane_weights says.
void DepthPreprocessor::mark_jump(PreparedDepth& view, int u, int v) {
  const std::size_t i = static_cast<std::size_t>(v) * blocks_x_ + u;
  if (block_jumps_[i] < 0) return;
  PreparedDepth::Block& block = view.blocks[i];
  block.jump = block_jumps_[i];
  const float* q = &view.inverse_depth[static_cast<std::size_t>(2 * v) * width_ + 2 * u];
  constexpr float kNone = std::numeric_limits<float>::max();
  float low = kNone;  // of the pixels that are measured
  for (const float pixel : {q[0], q[1], q[width_], q[width_ + 1]})
    if (pixel > 0) low = std::min(low, pixel);
  if (low == kNone) return;
  const PreparedDepth::Jump& jump = view.jumps[static_cast<std::size_t>(block.jump)];
  const Eigen::Vector2f centre(2 * static_cast<float>(u) + 0.5f, 2 * static_cast<float>(v) + 0.5f);
  const float reach_px = jump.occlusion_px + kToCorner_px;
  const bool clear = jump.far < 0 || (jump.pixel - centre).squaredNorm() > reach_px * reach_px;
  if (block.weight > 0 && clear) {
    if (low > jump.divide) view.plane_weights[i] = -block.weight;
    return;
  }
  // Depth up to which a pixel next to a jump observes anything (DepthLookup::near_jump).
  const auto until_m = [&](float inverse) {
    return kDepthLookup.deep_ratio / inverse + kDepthLookup.behind_grazing * truncation_m_ +
           kDepthLookup.deep_voxels * voxel_m_;
  };
  float& hidden_m = block_hidden_m_[i];
  hidden_m = std::max(hidden_m, until_m(low));
  if (!clear) hidden_m = std::max(hidden_m, until_m(view.inverse_depth[static_cast<std::size_t>(jump.far)]));
  view.plane_weights[i] = PreparedDepth::kJump;
  view.jump_depth_m[i] = hidden_m;
}

/// Depth behind which nothing is observed, and whether there are jumps, per tile.
void DepthPreprocessor::measure_hidden(PreparedDepth& view) const {
  constexpr int kBlocks = PreparedDepth::kTile / 2;
  for (int y = 0; y < view.tiles_y; ++y)
    for (int v = y * kBlocks; v < std::min((y + 1) * kBlocks, blocks_y_); ++v)
      for (int x = 0; x < view.tiles_x; ++x) {
        const float* first = &block_hidden_m_[static_cast<std::size_t>(v) * blocks_x_];
        const std::int32_t* jumps = &block_jumps_[static_cast<std::size_t>(v) * blocks_x_];
        PreparedDepth::Tile& tile = view.tiles[static_cast<std::size_t>(y) * view.tiles_x + x];
        for (int u = x * kBlocks; u < std::min((x + 1) * kBlocks, blocks_x_); ++u) {
          tile.hidden_m = std::max(tile.hidden_m, first[u]);
          tile.jumps |= jumps[u] >= 0;
        }
      }
}

/// Second differences along rows vanish on planes: their mean magnitude relative to that expected from the noise model.
void DepthPreprocessor::measure_noise(PreparedDepth& view) const {
  double sum = 0;
  int count = 0;
  for (int v = 0; v < blocks_y_; v += 3)
    for (int u = 1; u + 1 < blocks_x_; u += 3) {
      const float* q = &block_inverse_[static_cast<std::size_t>(v) * blocks_x_ + u];
      if (q[-1] == 0 || q[0] == 0 || q[1] == 0 || std::abs(q[1] - q[-1]) > max_surface_step(q[0], 4, focal_, noise_))
        continue;
      // E|x| = 0.8 σ for a Gaussian.
      sum += static_cast<double>(std::abs(q[-1] - 2 * q[0] + q[1]) / (0.8f * second_difference_sigma(*q, noise_)));
      ++count;
    }
  view.noise_scale = count > 0 ? static_cast<float>(sum / count) : 0.0f;
}

/// Smallest depths of row y of the tiles.
void DepthPreprocessor::measure_tiles(PreparedDepth& view, int y) const {
  for (int x = 0; x < view.tiles_x; ++x) {
    const int first_u = x * PreparedDepth::kTile, end_u = std::min(first_u + PreparedDepth::kTile, width_),
              end_v = std::min((y + 1) * PreparedDepth::kTile, height_);
    Simd4 highs{};
    Simd4Int measured{-1, -1, -1, -1};
    float high = 0;
    bool complete = true;
    for (int v = y * PreparedDepth::kTile; v < end_v; ++v) {
      const float* row = &view.inverse_depth[static_cast<std::size_t>(v) * width_];
      int u = first_u;
      for (; u + 4 <= end_u; u += 4) {
        const Simd4 q = load(row + u);
        highs = max(highs, q);
        measured &= q > 0;
      }
      for (; u < end_u; ++u) {
        high = std::max(high, row[u]);
        complete &= row[u] > 0;
      }
    }
    for (int k = 0; k < 4; ++k) {
      high = std::max(high, highs[k]);
      complete &= measured[k] != 0;
    }
    PreparedDepth::Tile& tile = view.tiles[static_cast<std::size_t>(y) * view.tiles_x + x];
    tile.complete = complete;
    if (high == 0) continue;
    tile.near_m = 1 / high;
  }
}

}  // namespace lumigraft::reconstruct
