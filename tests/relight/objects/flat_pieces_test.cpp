#include "relight/objects/flat_pieces.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::test {
namespace {

double covered(const relight::FlatPiece& piece) {
  const double sum = std::accumulate(piece.outline.begin(), piece.outline.end(), 0.0);
  return sum / (255.0 * static_cast<double>(piece.outline.size()));
}

TEST(FlatPieces, SixSidesOfABox) {
  const std::vector<relight::FlatPiece> pieces =
      relight::flat_pieces(model_of(box({-0.4f, -0.2f, 0}, {0.4f, 0.2f, 0.1f})));
  ASSERT_EQ(pieces.size(), 6u);
  for (const relight::FlatPiece& piece : pieces) {
    EXPECT_FALSE(piece.two_sided);
    EXPECT_NEAR(piece.normal.dot(piece.centre_m), piece.offset_m, 1e-6);
    EXPECT_NEAR(4 * piece.half_along_m.norm() * piece.half_across_m.norm(), piece.area_m2, 1e-5);
    EXPECT_NEAR(covered(piece), 1, 1e-6);
    EXPECT_NEAR(piece.normal.dot(piece.half_along_m), 0, 1e-6);
    EXPECT_GT(piece.normal.dot(piece.centre_m - Eigen::Vector3f(0, 0, 0.05f)), 0);  // outwards
  }
  EXPECT_NEAR(pieces[0].area_m2, 0.32, 1e-5);
}

TEST(FlatPieces, ASheetHasTwoSidesAndATurnedOutline) {
  Points corners;
  const Eigen::AngleAxisf turn(0.4f, Eigen::Vector3f::UnitZ());
  const auto at = [&](float x, float y) { return Eigen::Vector3f(turn * Eigen::Vector3f(x, y, 0.3f)); };
  add_quad(&corners, at(-0.3f, -0.1f), at(0.3f, -0.1f), at(0.3f, 0.1f), at(-0.3f, 0.1f));
  const std::vector<relight::FlatPiece> pieces = relight::flat_pieces(model_of(corners));
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_TRUE(pieces[0].two_sided);
  EXPECT_NEAR(4 * pieces[0].half_along_m.norm() * pieces[0].half_across_m.norm(), 0.12, 1e-5);
  EXPECT_NEAR(covered(pieces[0]), 1, 1e-6);
}

TEST(FlatPieces, ADiscFillsItsFractionOfTheRectangle) {
  Points corners;
  constexpr int kSides = 64;
  const auto at = [](int i) {
    const float phi = 6.2831853f * static_cast<float>(i) / kSides;
    return Eigen::Vector3f(0.2f * std::cos(phi), 0.2f * std::sin(phi), 0);
  };
  for (int i = 0; i < kSides; ++i) {
    for (const Eigen::Vector3f& p : {Eigen::Vector3f(0, 0, 0), at(i), at((i + 1) % kSides)}) corners.push_back(p);
  }
  const std::vector<relight::FlatPiece> pieces = relight::flat_pieces(model_of(corners));
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_NEAR(covered(pieces[0]), 0.785, 0.02);
}

TEST(FlatPieces, NothingOfABallIsFlat) {
  relight::Model ball = model_of(sphere(0.2f, 12));
  for (std::size_t i = 0; i < ball.normals.size(); ++i) ball.normals[i] = ball.positions_m[i].normalized();
  EXPECT_TRUE(relight::flat_pieces(ball).empty());
}

}  // namespace
}  // namespace lumigraft::test
