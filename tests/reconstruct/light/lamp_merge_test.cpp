// Pieces of one wide lamp: merged, placed, and separated again.
#include "reconstruct/light/lamp_merge.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

PointLight piece(int id, const Vector3f& direction, float irradiance) {
  PointLight light;
  light.id = id;
  light.direction = direction.normalized();
  light.irradiance = Vector3f::Constant(irradiance);
  light.angular_radius_rad = 0.1f;
  light.region = 0;
  return light;
}

PointLight lamp(int id) {
  PointLight light = piece(id, {0, -1, 1}, 2);
  light.region = -1;
  return light;
}

/// `joined` as a panel 2 m along its direction, facing along `normal`.
PointLight panel(PointLight joined, const Vector3f& normal) {
  joined.distance_known = joined.flat = true;
  joined.position_m = 2 * joined.direction;
  joined.normal = normal.normalized();
  return joined;
}

TEST(LampMerge, MergedLampIsTheSumOfItsPieces) {
  PointLight dim = piece(4, {1, 0, 0}, 1);
  const PointLight bright = piece(7, {0, 1, 0}, 3);
  dim.clipped = true;
  const std::vector<PointLight> joined = merge_pieces({bright, lamp(2), dim});
  ASSERT_EQ(joined.size(), 2U);
  EXPECT_TRUE(joined[0].irradiance.isApprox(Vector3f::Constant(4)));
  EXPECT_TRUE(joined[0].direction.isApprox(Vector3f(1, 3, 0).normalized())) << "weighted by irradiance";
  EXPECT_NEAR(1 - std::cos(joined[0].angular_radius_rad), 2 * (1 - std::cos(0.1)), 1e-6) << "twice the solid angle";
  EXPECT_TRUE(joined[0].clipped);
  EXPECT_EQ(joined[1].id, 2);
  EXPECT_EQ(joined[1].irradiance, lamp(2).irradiance);
}

// Which piece is the brightest, and therefore first, changes with noise.
TEST(LampMerge, OrderOfPiecesDoesNotMatter) {
  const PointLight a = piece(7, {1, 0, 2}, 3), b = piece(4, {-1, 0, 2}, 2.9f), c = piece(9, {0, 1, 2}, 2.8f);
  for (const auto& order : {std::vector{a, b, c}, std::vector{b, a, c}, std::vector{c, a, b}})
    EXPECT_EQ(merge_pieces(order).at(0).id, 4);
}

TEST(LampMerge, PiecesLieOnThePanelAndShareItsGain) {
  const std::vector<PointLight> pieces{piece(0, {0.3f, 0, 1}, 3), lamp(1), piece(2, {-0.3f, 0, 1}, 3)};
  const std::vector<PointLight> joined = merge_pieces(pieces);
  std::vector<PointLight> placed = joined;
  placed[0] = panel(placed[0], {0, 0, -1});
  placed[0].irradiance *= 2;
  const std::vector<PointLight> found = place_pieces(pieces, joined, placed, Vector3f::Zero());
  for (const int i : {0, 2}) {
    const PointLight& one = found.at(static_cast<std::size_t>(i));
    EXPECT_TRUE(one.irradiance.isApprox(Vector3f::Constant(6)));
    EXPECT_TRUE(one.position_m.isApprox(Vector3f(i == 0 ? 0.6f : -0.6f, 0, 2)));
    EXPECT_TRUE(one.intensity.isApprox(one.irradiance * one.position_m.squaredNorm()));
    EXPECT_TRUE(one.flat);
    EXPECT_EQ(one.normal, placed[0].normal);
  }
  EXPECT_FALSE(found[1].distance_known);
  EXPECT_EQ(found[1].irradiance, lamp(1).irradiance);
}

// The plane of a slanted panel does not reach the direction of one piece: that piece is not flat, as a panel emits
// nothing backwards.
TEST(LampMerge, PieceThatMissesThePlaneIsNotFlat) {
  const std::vector<PointLight> pieces{piece(0, {0, 0, 1}, 30), piece(2, {1, 0, 0.2f}, 1)};
  const std::vector<PointLight> joined = merge_pieces(pieces);
  const std::vector<PointLight> placed{panel(joined[0], {0.4f, 0, -1})};
  ASSERT_LT(placed[0].normal.dot(joined[0].direction), 0);
  ASSERT_GT(placed[0].normal.dot(pieces[1].direction), 0) << "seen from behind";
  const std::vector<PointLight> found = place_pieces(pieces, joined, placed, Vector3f::Zero());
  EXPECT_TRUE(found[0].flat);
  EXPECT_FALSE(found[1].flat);
  EXPECT_NEAR(found[1].position_m.norm(), 2, 1e-5);
  EXPECT_EQ(found[1].emission(Vector3f::UnitX()), 1);
}

TEST(LampMerge, GrazingPanelHasBoundedEmission) {
  PointLight along = panel(piece(0, {1, 0, 0}, 1), {-0.01f, 0, -1});
  EXPECT_LE(along.emission(-Vector3f::UnitZ()), 10);
  along.normal = -along.normal;
  EXPECT_GE(along.emission(Vector3f::UnitZ()), 0);
  EXPECT_LE(along.emission(Vector3f::UnitZ()), 10);
}

}  // namespace
}  // namespace lumigraft::reconstruct
