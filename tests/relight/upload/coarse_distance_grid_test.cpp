#include "relight/upload/coarse_distance_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lumigraft::relight {
namespace {

std::vector<float> by_trying_all(const std::vector<LatticePoint>& points, const Eigen::Vector3i& size,
                                 const Eigen::Vector3f& low_m, float cell_m, float max_m) {
  std::vector<float> distances;
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        const Eigen::Vector3f middle = low_m + cell_m * Eigen::Vector3f(x + 0.5f, y + 0.5f, z + 0.5f);
        float nearest = max_m;
        for (const LatticePoint& p : points) nearest = std::min(nearest, (p.position_m - middle).norm());
        distances.push_back(nearest);
      }
    }
  }
  return distances;
}

const Eigen::Vector3i kSize(13, 9, 11);
const Eigen::Vector3f kLow_m(-0.3f, 0.1f, 0.2f);
constexpr float kCell_m = 0.05f;

std::vector<LatticePoint> scattered(int count, float spread) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<LatticePoint> points;
  for (int i = 0; i < count; ++i) {
    LatticePoint p;
    for (int a = 0; a < 3; ++a) p.cell[a] = static_cast<int>(unit(random) * static_cast<float>(kSize[a]));
    const Eigen::Vector3f in_cell(unit(random), unit(random), unit(random));
    p.position_m =
        kLow_m + kCell_m * (p.cell.cast<float>().array() + 0.5f + spread * (in_cell.array() - 0.5f)).matrix();
    points.push_back(p);
  }
  return points;
}

TEST(SurfaceLattice, IsExactWherePointsLieInTheMiddleOfTheirCells) {
  for (const int count : {1, 5, 60}) {
    const auto points = scattered(count, 0);
    const auto fast = lattice_distances(points, kSize, kLow_m, kCell_m, 10);
    const auto slow = by_trying_all(points, kSize, kLow_m, kCell_m, 10);
    ASSERT_EQ(fast.size(), slow.size());
    for (std::size_t i = 0; i < fast.size(); ++i) EXPECT_NEAR(fast[i], slow[i], 1e-5f) << i;
  }
}

// The point of the nearest cell lies at most half a cell's diagonal farther than the cell, the nearest point as much
// nearer than its own.
TEST(SurfaceLattice, IsAtMostACellsDiagonalTooLong) {
  const auto points = scattered(40, 1);
  const auto fast = lattice_distances(points, kSize, kLow_m, kCell_m, 10);
  const auto slow = by_trying_all(points, kSize, kLow_m, kCell_m, 10);
  double excess = 0;
  for (std::size_t i = 0; i < fast.size(); ++i) {
    EXPECT_GE(fast[i], slow[i] - 1e-5f);
    EXPECT_LE(fast[i], slow[i] + std::sqrt(3.0f) * kCell_m);
    excess += (fast[i] - slow[i]) / kCell_m;
  }
  EXPECT_LT(excess / static_cast<double>(fast.size()), 0.1);
}

TEST(SurfaceLattice, WithoutPointsOrFarFromThemIsTheMaximum) {
  for (const float d : lattice_distances({}, kSize, kLow_m, kCell_m, 0.7f)) EXPECT_EQ(d, 0.7f);
  const auto one = lattice_distances(scattered(1, 1), kSize, kLow_m, kCell_m, 0.1f);
  EXPECT_EQ(*std::max_element(one.begin(), one.end()), 0.1f);
}

}  // namespace
}  // namespace lumigraft::relight
