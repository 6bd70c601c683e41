// The delta's hierarchy beside the difference of two (Franke 2015, eq. 5.27).
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <random>

#include "relight/passes/filter.h"
#include "sweep.h"

namespace lumigraft::test {
namespace {

class MipSweep : public SweepTest {};
ON_BOTH_DEVICES(MipSweep);

constexpr int kEdge = 32, kMips = 5;

using Texels = std::vector<Eigen::Vector4f>;

Texels halves(const std::vector<std::byte>& bytes) {
  Texels texels(bytes.size() / 8);
  const auto* half = reinterpret_cast<const Eigen::half*>(bytes.data());
  for (std::size_t i = 0; i < 4 * texels.size(); ++i) texels[i / 4][static_cast<int>(i % 4)] = float{half[i]};
  return texels;
}

// A room's radiance μ, the same with an object's shadow and bounce ρ, and Δ = ρ - μ, each times the surface's weight:
// the hierarchy that cones look up. All three share the weight, so the mean radiance of a footprint in ρ is that in μ
// and in Δ together, at every level, but for the rounding of halves. Where ρ has the object's own weight too, as two
// complete solutions have, it is not: that is the error of eq. 5.27.
TEST_P(MipSweep, DeltaBesideTheDifferenceOfTwo) {
  std::mt19937 random(7);
  const auto uniform = [&] { return static_cast<float>(random() & 0xFFFFu) / 65535.0f; };
  Texels mu, rho, delta, rho_own;
  for (int i = 0; i < kEdge * kEdge * kEdge; ++i) {
    const float weight = uniform() < 0.3f ? uniform() : 0, before = uniform(), after = before * uniform();
    const float object = uniform() < 0.1f ? uniform() : 0, of_object = uniform();
    mu.push_back(weight * Eigen::Vector4f(before, before, before, 1));
    rho.push_back(weight * Eigen::Vector4f(after, after, after, 1));
    delta.push_back(weight * Eigen::Vector4f(after - before, after - before, after - before, 1));
    rho_own.push_back(rho.back() + object * Eigen::Vector4f(of_object, of_object, of_object, 1));
  }
  const Filter filter(*device_);
  const auto hierarchy = [&](const Texels& texels) {
    const auto volume = device_->create_texture({.name = "volume",
                                                 .width = kEdge,
                                                 .height = kEdge,
                                                 .depth = kEdge,
                                                 .volume = true,
                                                 .mips = kMips,
                                                 .format = gpu::Format::rgba16_float});
    std::vector<Eigen::half> packed;
    for (const Eigen::Vector4f& texel : texels) {
      for (const float x : texel) packed.emplace_back(x);
    }
    device_->upload(*volume, 0, std::as_bytes(std::span(packed)));
    const auto list = device_->begin();
    filter.record(*list, *volume);
    device_->submit(*list);
    std::vector<Texels> levels;
    for (int mip = 0; mip < kMips; ++mip) levels.push_back(halves(device_->download(*volume, mip)));
    return levels;
  };
  const auto m = hierarchy(mu), r = hierarchy(rho), d = hierarchy(delta), own = hierarchy(rho_own);
  Sweep sweep{.stem = "delta-mips",
              .title = "Delta's hierarchy beside the difference of two (eq. 5.27)",
              .x_label = "level of the hierarchy",
              .y_label = "RMS difference / RMS change",
              .x = {0, 1, 2, 3, 4},
              .curves = {{"one weight for both"}, {"a weight of its own each"}}};
  for (std::size_t level = 0; level < kMips; ++level) {
    double squares = 0, squares_own = 0, all = 0;
    for (std::size_t i = 0; i < m[level].size(); ++i) {
      const auto mean = [](const Eigen::Vector4f& s) { return s.w() < 1e-3f ? 0.0 : double{s.x() / s.w()}; };
      const double change = mean(d[level][i]);
      const double off = mean(r[level][i]) - mean(m[level][i]) - change;
      const double off_own = mean(own[level][i]) - mean(m[level][i]) - change;
      squares += off * off;
      squares_own += off_own * off_own;
      all += change * change;
    }
    sweep.curves[0].y.push_back(std::sqrt(squares / all));
    sweep.curves[1].y.push_back(std::sqrt(squares_own / all));
  }
  write(sweep);
  for (const double error : sweep.curves[0].y) EXPECT_LT(error, 0.004);
}

}  // namespace
}  // namespace lumigraft::test
