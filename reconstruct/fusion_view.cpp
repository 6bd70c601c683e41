#include "reconstruct/fusion_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumigraft {
namespace {

// Beyond this incidence two neighbouring pixels count as two surfaces, and a pixel's plane is not to be trusted.
constexpr float kSteepest = 5.0f;        // tan 79°
constexpr float kLeastFacing = 0.1f;     // cos 84°
constexpr double kLeastSigmaM = 0.0012;  // of the noise model, at 0.4 m

/// What eq. 3 adds to eq. 2 beyond 10 degrees, over 0.0001 / √z.
double oblique(double incidence_rad) {
  if (incidence_rad <= M_PI / 18) return 0;
  const double rest = std::max(M_PI / 2 - incidence_rad, 1e-3);
  return incidence_rad * incidence_rad / (rest * rest);
}

}  // namespace

double depth_sigma_m(double depth_m, double incidence_rad) {
  const double away = depth_m - 0.4;
  return kLeastSigmaM + 0.0019 * away * away + 0.0001 / std::sqrt(depth_m) * oblique(incidence_rad);
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

Eigen::Vector2f PixelMap::pixel(float x_over_z, float y_over_z) const {
  const float u = fx_ * x_over_z + cx_, v = fy_ * y_over_z + cy_;
  if (table_.empty()) return {u, v};
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
      focal_(static_cast<float>((camera.fx + camera.fy) / 2)),
      voxel_m_(static_cast<float>(voxel_m)),
      far_m_(static_cast<float>(far_m)) {
  for (std::size_t i = 0; i < oblique_.size(); ++i) {
    const double facing = std::min(1.0, (static_cast<double>(i) + 0.5) / kObliqueSteps);
    oblique_[i] = static_cast<float>(oblique(std::acos(facing)));
  }
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      const auto d = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      rays_.push_back(d && d->z() > 0 ? Eigen::Vector2f((d->head<2>() / d->z()).cast<float>())
                                      : Eigen::Vector2f(kNaN, kNaN));
    }
}

DepthView DepthPreparation::prepare(const Image<float>& depth_m) const {
  DepthView view;
  view.width = width_;
  view.height = height_;
  view.inverse_depth.assign(rays_.size(), 0.0f);
  view.tile_far_m = Image<float>((width_ + DepthView::kTile - 1) / DepthView::kTile,
                                 (height_ + DepthView::kTile - 1) / DepthView::kTile, 1);
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      const std::size_t i = view.index(u, v);
      const float depth = depth_m.data[i];
      if (!(depth > 0 && depth <= far_m_) || std::isnan(rays_[i].x())) continue;
      view.inverse_depth[i] = 1 / depth;
      float& tile = view.tile_far_m.at(u / DepthView::kTile, v / DepthView::kTile);
      tile = std::max(tile, depth);
    }

  // On a plane 1/z is affine in the picture, so a jump shows as a slope no plane in reach would have. In inverse depth
  // q the slope of a surface inclined by θ is q tan θ / f per pixel.
  view.smooth.assign(rays_.size(), 0);
  const float steepest = kSteepest / focal_;
  for (int v = 0; v + 1 < height_; ++v)
    for (int u = 0; u + 1 < width_; ++u) {
      const std::size_t i = view.index(u, v);
      const float* q = &view.inverse_depth[i];
      const float low = std::min(std::min(q[0], q[1]), std::min(q[width_], q[width_ + 1]));
      const float high = std::max(std::max(q[0], q[1]), std::max(q[width_], q[width_ + 1]));
      view.smooth[i] = low > 0 && high - low <= steepest * high;
    }
  fit_planes(view);
  find_rims(view);
  return view;
}

namespace {

/// Slope per pixel of the line through q at −before … after, least squares.
float slope_along(const float* q, std::ptrdiff_t step, int before, int after) {
  float sum = 0, moment = 0;  // of q relative to the centre, in steps
  for (int k = -before; k <= after; ++k) {
    const float rise = q[k * step] - *q;
    sum += rise;
    moment += static_cast<float>(k) * rise;
  }
  const float n = static_cast<float>(before + after + 1);
  const float sk = static_cast<float>(after * (after + 1) - before * (before + 1)) / 2;
  const float skk =
      static_cast<float>(after * (after + 1) * (2 * after + 1) + before * (before + 1) * (2 * before + 1)) / 6;
  return (n * moment - sk * sum) / (n * skk - sk * sk);
}

}  // namespace

void DepthPreparation::fit_planes(DepthView& view) const {
  // Lines along the row and the column give the slopes of q: up to `reach` pixels to either side, until depth jumps.
  const int reach = std::clamp(static_cast<int>(std::lround(focal_ / 170)), 2, 5);
  const float steepest = kSteepest / focal_;
  const std::vector<float>& inverse_depth = view.inverse_depth;
  const auto continues = [&](std::size_t a, std::size_t b) {
    const float qa = inverse_depth[a], qb = inverse_depth[b];
    return qa > 0 && qb > 0 && std::abs(qa - qb) <= steepest * std::max(qa, qb);
  };
  // How far one surface goes on from each pixel.
  std::vector<std::uint8_t> left(rays_.size(), 0), right(left), up(left), down(left);
  const auto grow = [&](std::uint8_t from) { return static_cast<std::uint8_t>(std::min<int>(from + 1, reach)); };
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      const std::size_t i = view.index(u, v), j = rays_.size() - 1 - i;  // j runs backwards
      if (u > 0 && continues(i - 1, i)) left[i] = grow(left[i - 1]);
      if (v > 0 && continues(i - width_, i)) up[i] = grow(up[i - width_]);
      if (u > 0 && continues(j + 1, j)) right[j] = grow(right[j + 1]);
      if (v > 0 && continues(j + width_, j)) down[j] = grow(down[j + width_]);
    }

  const auto plane_at = [&](int u, int v) -> DepthView::Pixel {
    const std::size_t i = view.index(u, v);
    const float* q = &inverse_depth[i];
    if (left[i] + right[i] == 0 || up[i] + down[i] == 0) return {};
    const float by_u = slope_along(q, 1, left[i], right[i]), by_v = slope_along(q, width_, up[i], down[i]);
    // q = A x/z + B y/z + C, and (A, B, C) is the plane's normal over its distance.
    const int west = std::max(u - 1, 0), east = std::min(u + 1, width_ - 1), north = std::max(v - 1, 0),
              south = std::min(v + 1, height_ - 1);
    const float a = by_u * static_cast<float>(east - west) / (ray(east, v).x() - ray(west, v).x());
    const float b = by_v * static_cast<float>(south - north) / (ray(u, south).y() - ray(u, north).y());
    const Eigen::Vector2f& r = rays_[i];
    const float c = *q - a * r.x() - b * r.y();
    const float scale = *q / std::sqrt(a * a + b * b + c * c);
    const float facing = std::min(scale / std::sqrt(1 + r.x() * r.x() + r.y() * r.y()), 1.0f);
    if (!(facing >= kLeastFacing)) return {};
    // depth_sigma_m(1 / q, acos(facing)), its angular part from the table.
    const float away = 1 / *q - 0.4f;
    const float sigma = static_cast<float>(kLeastSigmaM) + 0.0019f * away * away +
                        0.0001f * std::sqrt(*q) * oblique_[static_cast<std::size_t>(facing * kObliqueSteps)];
    return {scale, facing, static_cast<float>(kLeastSigmaM * kLeastSigmaM) / (sigma * sigma)};
  };
  // Four pixels that see one surface share its plane.
  view.pixels.assign(rays_.size(), {});
  for (int v = 0; v < height_; v += 2)
    for (int u = 0; u < width_; u += 2) {
      const std::size_t i = view.index(u, v);
      const DepthView::Pixel first = plane_at(u, v);
      view.pixels[i] = first;
      const bool wide = u + 1 < width_, high = v + 1 < height_;
      if (wide) view.pixels[i + 1] = view.smooth[i] ? first : plane_at(u + 1, v);
      if (high) view.pixels[i + width_] = view.smooth[i] ? first : plane_at(u, v + 1);
      if (wide && high) view.pixels[i + width_ + 1] = view.smooth[i] ? first : plane_at(u + 1, v + 1);
    }
}

void DepthPreparation::find_rims(DepthView& view) const {
  view.near_rim.assign(rays_.size(), 0);
  for (int v = 0; v + 1 < height_; ++v)
    for (int u = 0; u + 1 < width_; ++u) {
      const std::size_t i = view.index(u, v);
      if (view.smooth[i]) continue;
      const float* q = &view.inverse_depth[i];
      const float nearest = std::max(std::max(q[0], q[1]), std::max(q[width_], q[width_ + 1]));
      if (nearest == 0) continue;
      const int reach = std::clamp(static_cast<int>(std::ceil(1.5f * voxel_m_ * focal_ * nearest)), 1, 16);
      for (int y = std::max(0, v + 1 - reach); y <= std::min(height_ - 1, v + reach); ++y)
        for (int x = std::max(0, u + 1 - reach); x <= std::min(width_ - 1, u + reach); ++x)
          // Pixels on the far side of the jump have no rim of their own.
          if (view.inverse_depth[view.index(x, y)] > 0.9f * nearest) view.near_rim[view.index(x, y)] = 1;
    }
}

}  // namespace lumigraft
