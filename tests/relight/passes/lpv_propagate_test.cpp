// Propagation through free space and past a wall: conservation, attenuation with distance, isotropy.
#include <cmath>
#include <numbers>

#include "relight/passes/lpv/lpv.h"
#include "relight/shaders/lpv/lpv_kernel.h"
#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight::gpu {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kEdge = 32;
using Cell = Eigen::Vector4f;  // Φ, J

std::size_t index_of(const Eigen::Vector3i& at, int cascade = 0) {
  return static_cast<std::size_t>(at.x() + kEdge * (at.y() + kEdge * (at.z() + kEdge * cascade)));
}

/// Cells or open fractions of one cascade; the other cascade is empty.
struct Volume {
  std::vector<Cell> cells = std::vector<Cell>(2u * kEdge * kEdge * kEdge, Cell::Zero());
  Cell& at(const Eigen::Vector3i& place) { return cells[index_of(place)]; }
  const Cell& at(const Eigen::Vector3i& place) const { return cells[index_of(place)]; }
};

/// Mean of the eight surrounding cells; position in cells from the low corner.
Cell sample(const Volume& volume, const Eigen::Vector3f& place) {
  const Eigen::Vector3f g = place - Eigen::Vector3f::Constant(0.5f);
  const Eigen::Vector3i base = g.array().floor().matrix().cast<int>();
  Cell sum = Cell::Zero();
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3i o(i & 1, (i >> 1) & 1, i >> 2);
    const Eigen::Vector3f f = g - base.cast<float>();
    float weight = 1;
    for (int a = 0; a < 3; ++a) weight *= o[a] ? f[a] : 1 - f[a];
    sum += weight * volume.at(base + o);
  }
  return sum;
}

/// The same as in lpv_query.glsl, for cells of 1 m.
float irradiance(const Volume& volume, const Eigen::Vector3f& place, const Eigen::Vector3f& normal) {
  const Cell cell = sample(volume, place + shader::kLpvShift * normal);
  return shader::kLpvEven * cell[0] - shader::kLpvDirected * normal.dot(cell.tail<3>());
}

class LpvPropagation : public DeviceTest {
 protected:
  /// `open`: fraction of light that passes from the first cell to the second, its neighbour.
  template <typename Open>
  Volume carried(const Volume& source, int sweeps, Open&& open) {
    Lpv lpv(*device_);
    lpv.fit(*device_, 2 * kEdge, 0);
    const LpvGrid& grid = lpv.grid();
    const std::size_t cells = source.cells.size();
    std::vector<Eigen::half> low(4 * cells), high(4 * cells);
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) {
          const Eigen::Vector3i to(x, y, z);
          for (int a = 0; a < 3; ++a) {
            const Eigen::Vector3i step = Eigen::Vector3i::Unit(a);
            const std::size_t i = 4 * index_of(to) + static_cast<std::size_t>(a);
            low[i] = Eigen::half(to[a] > 0 ? open(to - step, to) : 0.0f);
            high[i] = Eigen::half(to[a] < kEdge - 1 ? open(to + step, to) : 0.0f);
          }
        }
      }
    }
    device_->upload(*grid.from_low, 0, std::as_bytes(std::span(low)));
    device_->upload(*grid.from_high, 0, std::as_bytes(std::span(high)));
    for (const auto& texture : grid.source) device_->upload(*texture, 0, std::as_bytes(std::span(source.cells)));
    const auto list = device_->begin();
    lpv.propagate(*list, shader::FrameParams{}, sweeps, false);
    device_->submit(*list);
    const std::vector<float> red = values_of<float>(device_->download(*grid.light[0]));
    EXPECT_EQ(red, values_of<float>(device_->download(*grid.light[2])));
    Volume light;
    for (std::size_t i = 0; i < light.cells.size(); ++i) light.cells[i] = Eigen::Map<const Cell>(&red[4 * i]);
    return light;
  }
  Volume carried(const Volume& source, int sweeps) {
    return carried(source, sweeps, [](const auto&, const auto&) { return 1.0f; });
  }
};
ON_BOTH_DEVICES(LpvPropagation);

/// Total flux that has left the volume.
double left(const Volume& light) {
  double sum = 0;
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) {
        const Eigen::Vector3i at(x, y, z);
        const Cell& cell = light.at(at);
        for (int a = 0; a < 3; ++a) {
          if (at[a] == 0) sum += shader::kLpvStay * cell[0] - shader::kLpvAhead * cell[1 + a];
          if (at[a] == kEdge - 1) sum += shader::kLpvStay * cell[0] + shader::kLpvAhead * cell[1 + a];
        }
      }
    }
  }
  return sum;
}

Volume some_sources() {
  Volume source;
  source.at({9, 20, 14}) << 3, 1, -0.5f, 0.2f;
  source.at({16, 15, 16}) << -1, 0, 0.6f, 0;
  source.at({24, 7, 12}) << 1.5f, 0.3f, 0.3f, 0.9f;
  return source;
}

// Six cells together receive the content of one, of either sign: in the end the flux that left equals the injected
// flux.
TEST_P(LpvPropagation, EnergyStaysTheSame) {
  const Volume source = some_sources();
  EXPECT_NEAR(left(carried(source, 100)), 3 - 1 + 1.5, 1e-3 * 5.5);
}

// The same inside a closed box: the absorbed flux equals the injected flux. Half-open faces absorb half.
TEST_P(LpvPropagation, WallsAbsorbWhatDoesNotGetThrough) {
  const Volume source = some_sources();
  const auto inside = [](const Eigen::Vector3i& p) { return (p.array() >= 4).all() && (p.array() < 28).all(); };
  const auto open = [&](const Eigen::Vector3i& from, const Eigen::Vector3i& to) {
    if (inside(from) != inside(to)) return 0.0f;
    return from.x() + to.x() == 25 ? 0.5f : 1.0f;  // a half-open wall across the box
  };
  const Volume light = carried(source, 100, open);
  double absorbed = 0, outside = 0;
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) {
        const Eigen::Vector3i at(x, y, z);
        const Cell& cell = light.at(at);
        if (!inside(at)) outside += cell.cwiseAbs().sum();
        for (int face = 0; face < 6; ++face) {
          const int a = face / 2, sign = face % 2 ? -1 : 1;
          const Eigen::Vector3i to = at + sign * Eigen::Vector3i::Unit(a);
          if ((to.array() < 0).any() || (to.array() >= kEdge).any()) continue;
          const double sent = shader::kLpvStay * cell[0] + sign * shader::kLpvAhead * cell[1 + a];
          absorbed += (1 - double{open(at, to)}) * sent;
        }
      }
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_NEAR(absorbed, 3 - 1 + 1.5, 1e-3 * 5.5);
}

TEST_P(LpvPropagation, IsLinearAndSigned) {
  Volume source = some_sources();
  const Volume once = carried(source, 8);
  for (Cell& cell : source.cells) cell *= -2;
  const Volume twice = carried(source, 8);
  for (std::size_t i = 0; i < once.cells.size(); ++i) EXPECT_EQ(twice.cells[i], -2 * once.cells[i]);
}

// Exchanging axes, or reversing one, exchanges or reverses the light in the same way, up to rounding.
TEST_P(LpvPropagation, TreatsAllAxesAlike) {
  const auto turned = [](const Volume& volume, bool mirror) {
    Volume result;
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) {
          const Cell& c = volume.at({x, y, z});
          if (mirror)
            result.at({x, kEdge - 1 - y, z}) << c[0], c[1], -c[2], c[3];
          else
            result.at({y, z, x}) << c[0], c[2], c[3], c[1];
        }
      }
    }
    return result;
  };
  const Volume source = some_sources(), light = carried(source, 60);
  for (const bool mirror : {false, true}) {
    const Volume got = carried(turned(source, mirror), 60), want = turned(light, mirror);
    float max_off = 0;
    for (std::size_t i = 0; i < got.cells.size(); ++i) {
      max_off = std::max(max_off, (got.cells[i] - want.cells[i]).cwiseAbs().maxCoeff());
    }
    EXPECT_LT(max_off, 1e-4f);
  }
}

// An isotropic point light of intensity Φ / 4π: a surface that faces it receives Φ / (4π r²). Four coefficients per
// cell represent the direction of a beam but not its width, so distant light is too diffuse: it is attenuated a little
// less, and some of it reaches surfaces that face away. Along axes and diagonals.
TEST_P(LpvPropagation, FallsOffWithTheSquareOfTheDistance) {
  Volume source;
  source.at({16, 16, 16}) << 100, 0, 0, 0;
  const Volume light = carried(source, 16);
  double squares = 0, max_off = 0, away = 0;
  int count = 0;
  for (const Eigen::Vector3f& along : {Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(1, 1, 0), Eigen::Vector3f(1, 1, 1),
                                       Eigen::Vector3f(2, 1, 0), Eigen::Vector3f(-1, 2, 2)}) {
    for (const float r : {3.0f, 4.0f, 5.5f, 7.0f, 9.0f}) {
      const Eigen::Vector3f w = along.normalized(), p = Eigen::Vector3f::Constant(16.5f) + r * w;
      const float want = 100 / (4 * kPi * r * r);
      const double off = irradiance(light, p, -w) / want - 1;
      squares += off * off;
      max_off = std::max(max_off, std::abs(off));
      away += irradiance(light, p, w) / want;
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.4);
  EXPECT_LT(max_off, 0.6);
  EXPECT_LT(std::abs(away / count), 0.2);
}

}  // namespace
}  // namespace lumigraft::relight::gpu
