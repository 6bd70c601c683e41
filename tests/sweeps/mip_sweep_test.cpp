// The mip hierarchy of the delta, compared with the difference of two hierarchies (Franke 2015, eq. 5.27).
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstring>
#include <random>

#include "relight/passes/volume/bounce.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class MipSweep : public SweepTest {};
ON_VULKAN(MipSweep);

constexpr int kEdge = 64, kMips = 5;

using Texels = std::vector<Eigen::Vector4f>;

Texels halves(const std::vector<std::byte>& bytes) {
  Texels texels(bytes.size() / 8);
  const auto* half = reinterpret_cast<const Eigen::half*>(bytes.data());
  for (std::size_t i = 0; i < 4 * texels.size(); ++i) texels[i / 4][static_cast<int>(i % 4)] = float{half[i]};
  return texels;
}

/// Volumes with all chunks of the first cascade allocated, and the positions of texels in their pool.
struct FullVolumes {
  relight::Volumes volumes;
  std::vector<std::uint32_t> table;

  explicit FullVolumes(relight::gpu::Device& device) : volumes(device, kEdge) {
    std::vector<std::uint32_t> marks(volumes.real_chunks.marks().size_bytes() / 4, 1);
    device.upload(volumes.real_chunks.marks(), 0, std::as_bytes(std::span(marks)));
    volumes.fit_chunks(device, relight::Surfaces::real);
    const std::vector<std::byte> bytes = device.download(*volumes.chunk_table);
    table.resize(marks.size());
    std::memcpy(table.data(), bytes.data(), 4 * table.size());
  }
  std::size_t texel(int level, const Eigen::Vector3i& at) const {
    std::size_t place = 0;
    for (int finer = 0; finer < level; ++finer) {
      const auto along = static_cast<std::size_t>(relight::chunks_along(kEdge, finer));
      place += relight::shader::kCascades * along * along * along;
    }
    const int along = relight::chunks_along(kEdge, level), edge = relight::shader::kChunkEdge,
              row = relight::shader::kChunkRow;
    const Eigen::Vector3i chunk = at / edge;
    const int number =
        static_cast<int>(table[place + static_cast<std::size_t>(chunk.x() + along * (chunk.y() + along * chunk.z()))]);
    const Eigen::Vector3i first = (edge + 1) * Eigen::Vector3i(number % row, number / row % row, number / (row * row)),
                          to = first + at - edge * chunk;
    return static_cast<std::size_t>(to.x() + row * (edge + 1) * (to.y() + row * (edge + 1) * to.z()));
  }
  template <typename Function>
  static void each(int level, Function function) {
    const int n = kEdge >> level;
    for (int i = 0; i < n * n * n; ++i) function(Eigen::Vector3i(i % n, i / n % n, i / (n * n)));
  }
};

// A room's radiance μ, ρ with an object's shadow and bounce, and Δ = ρ - μ, each times the surface's weight: the
// hierarchy that cones look up. All three share the weight, so the mean radiance of a footprint in ρ equals that in μ
// plus that in Δ at every level, up to half-precision rounding. If ρ also has the object's own weight, as two complete
// solutions do, it does not: the error of eq. 5.27.
TEST_P(MipSweep, DeltaAndTheDifferenceOfTwo) {
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
  const relight::Bounce bounce(*device_);
  const FullVolumes full(*device_);
  relight::shader::FrameParams params{};
  params.grid.x() = kEdge;
  const auto hierarchy = [&](const Texels& texels) {
    relight::gpu::Texture& pool = *full.volumes.real_radiance;
    Texels packed(device_->download(pool).size() / 8, Eigen::Vector4f::Zero());
    std::size_t next = 0;
    FullVolumes::each(0, [&](const Eigen::Vector3i& at) { packed[full.texel(0, at)] = texels[next++]; });
    std::vector<Eigen::half> packed_halves;
    for (const Eigen::Vector4f& texel : packed) {
      for (const float x : texel) packed_halves.emplace_back(x);
    }
    device_->upload(pool, 0, std::as_bytes(std::span(packed_halves)));
    const auto list = device_->begin();
    bounce.filter(*list, params, full.volumes.real_chunks, pool, full.volumes);
    device_->submit(*list);
    const Texels all = halves(device_->download(pool));
    std::vector<Texels> levels(kMips);
    for (int mip = 0; mip < kMips; ++mip) {
      FullVolumes::each(mip, [&](const Eigen::Vector3i& at) {
        levels[static_cast<std::size_t>(mip)].push_back(all[full.texel(mip, at)]);
      });
    }
    return levels;
  };
  const auto m = hierarchy(mu), r = hierarchy(rho), d = hierarchy(delta), own = hierarchy(rho_own);
  Sweep sweep{.stem = "delta-mips",
              .title = "Delta's hierarchy and the difference of two (eq. 5.27)",
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
  write_sweep(sweep);
  for (const double error : sweep.curves[0].y) EXPECT_LT(error, 0.004);
}

}  // namespace
}  // namespace lumigraft::test
