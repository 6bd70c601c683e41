#include "reconstruct/fusion/steep_plane.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "reconstruct/fusion/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr int kBefore = kSteepPlane.window_px / 2 - 1;  // pixels of the window before the first of the block

/// Whether one row or column of the window rises on both sides of the block: a cheap test, since most jumps fail it.
bool continues(const float* q, std::ptrdiff_t step) {
  const float start = q[-kBefore * step], low = q[0], high = q[step], end = q[(kBefore + 1) * step];
  if (std::min(std::min(start, low), std::min(high, end)) <= 0) return false;
  const float whole = end - start, min_part = kSteepPlane.min_rise * std::abs(whole);
  return (low - start) * whole > min_part * std::abs(whole) && (end - high) * whole > min_part * std::abs(whole);
}

/// Slope of q over t by linear regression.
class Regression {
 public:
  void add(float t, float q) {
    ++n_;
    t_ += t;
    q_ += q;
    tt_ += t * t;
    tq_ += t * q;
  }
  int count() const { return n_; }
  float slope() const {
    const auto n = static_cast<float>(n_);
    return (tq_ - t_ * q_ / n) / (tt_ - t_ * t_ / n);
  }

 private:
  int n_ = 0;
  float t_ = 0, q_ = 0, tt_ = 0, tq_ = 0;
};

}  // namespace

std::optional<SteepPlane> steep_plane_at(const PreparedDepth& view, int u, int v, float focal,
                                         const capture::DepthNoise& noise) {
  constexpr int kWindow = kSteepPlane.window_px;
  const int left = u - kBefore, top = v - kBefore;
  if (left < 0 || top < 0 || left + kWindow > view.width || top + kWindow > view.height) return std::nullopt;
  const float* centre = &view.inverse_depth[static_cast<std::size_t>(view.pixel_index(u, v))];
  if (!continues(centre, 1) && !continues(centre, view.width)) return std::nullopt;

  const auto each = [&](auto&& visit) {
    for (int y = 0; y < kWindow; ++y) {
      const float* row = &view.inverse_depth[static_cast<std::size_t>(view.pixel_index(left, top + y))];
      for (int x = 0; x < kWindow; ++x)
        if (row[x] > 0)
          visit(static_cast<float>(x) - 0.5f * (kWindow - 1), static_cast<float>(y) - 0.5f * (kWindow - 1), row[x]);
    }
  };
  Eigen::Matrix3f normal = Eigen::Matrix3f::Zero();
  Eigen::Vector3f right = Eigen::Vector3f::Zero();
  each([&](float x, float y, float q) {
    const Eigen::Vector3f row(1, x, y);
    normal += row * row.transpose();
    right += q * row;
  });
  const float count = normal(0, 0);
  if (count < kSteepPlane.min_measured * kWindow * kWindow) return std::nullopt;
  const Eigen::Vector3f fit = normal.ldlt().solve(right);
  const float slope = fit.tail<2>().norm();
  if (!(fit[0] > 0 && slope > 0)) return std::nullopt;

  // What the noise of depth explains at this incidence.
  const float tangent = slope * focal / fit[0];
  const auto sigma_m = static_cast<float>(noise.sigma_m(1 / static_cast<double>(fit[0]), std::atan(tangent)));
  const float sigma = std::max(view.noise_scale, 1.0f) * sigma_m * fit[0] * fit[0];
  float misfit = 0;
  each([&](float x, float y, float q) { misfit += std::pow(q - fit[0] - fit[1] * x - fit[2] * y, 2.0f); });
  if (misfit > count * std::pow(kSteepPlane.max_noise * sigma, 2.0f)) return std::nullopt;

  const Eigen::Vector2f along = fit.tail<2>() / slope;
  Regression before, after;
  each([&](float x, float y, float q) {
    const float t = along.dot(Eigen::Vector2f(x, y));
    (t < 0 ? before : after).add(t, q);
  });
  if (std::min(before.count(), after.count()) < kSteepPlane.min_measured * kWindow * kWindow / 2) return std::nullopt;
  if (std::min(before.slope(), after.slope()) < kSteepPlane.min_continued * slope) return std::nullopt;
  return SteepPlane{fit[0], fit[1], fit[2]};
}

}  // namespace lumigraft::reconstruct
