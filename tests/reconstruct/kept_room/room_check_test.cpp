#include "reconstruct/kept_room/room_check.h"

#include <gtest/gtest.h>

#include "reconstruct/kept_room/parameters.h"
#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using namespace test;

using Verdict = RoomCheck::Verdict;
constexpr std::int64_t kLook_ns = kKeptRoom.check.interval_ns;

double block(const Vector3d& p, const Vector3d& middle, double half_m) {
  return ((p - middle).cwiseAbs().array() - half_m).maxCoeff();
}

/// A table in a corner of two walls.
double corner(const Vector3d& p) { return std::min({p.z(), 0.6 - p.x(), 0.5 - p.y()}); }
/// The same with a block in front of them; another table in front of a nearer wall.
double with_block(const Vector3d& p) { return std::min(corner(p), block(p, {0.25, 0.2, 0.2}, 0.15)); }
double elsewhere(const Vector3d& p) { return std::min(p.z(), 0.3 - p.x() - 0.3 * p.y()); }
/// Somebody stands in front of the camera.
double visitor(const Vector3d& p) { return std::min(corner(p), block(p, {-0.35, -0.35, 0.55}, 0.2)); }

Isometry3d into_the_corner() { return looking_at_tag(1.1, 55 * kDegree, -2.3, {0.25, 0.2, 0.15}); }

DistanceField kept_room(const Shape& shape) {
  FusionStage stage(session_with(small_camera()), {});
  const Isometry3d T = into_the_corner();
  return *fuse_all(stage, frame_of(shape, small_camera(), T), pose_at(T));
}

class RoomCheckTest : public testing::Test {
 protected:
  Verdict look(const DistanceField& kept, const Shape& shape, const Isometry3d& T = into_the_corner()) {
    time_ns += kLook_ns;
    return check.look(kept, frame_of(shape, small_camera(), T, 0, {1, ++seed}).depth->depth_m, T.cast<float>(),
                      time_ns);
  }
  RoomCheck check{small_camera()};
  std::int64_t time_ns = 0;
  unsigned seed = 1;
};

TEST_F(RoomCheckTest, TheSameRoomIsRecognizedInItsFirstFrame) {
  EXPECT_EQ(look(kept_room(corner), corner), Verdict::same);
  EXPECT_GT(check.points().all(), kKeptRoom.check.min_points);
  EXPECT_GT(check.points().on_surface, 0.98 * check.points().all());
}

TEST_F(RoomCheckTest, FurnitureMayBeMoved) {
  EXPECT_EQ(look(kept_room(with_block), corner), Verdict::same);
  EXPECT_GT(check.points().elsewhere, 30) << "or the block is too small for this test";
}

TEST_F(RoomCheckTest, FurnitureMayBeNew) { EXPECT_EQ(look(kept_room(corner), with_block), Verdict::same); }

/// Fraction of the image that shows the plane of the tag.
double table_fraction(const Shape& shape, const Isometry3d& T) {
  const capture::CameraModel camera = small_camera();
  int on_table = 0, all = 0;
  for (int v = 0; v < camera.height; v += 4)
    for (int u = 0; u < camera.width; u += 4, ++all) {
      const Vector3d direction = T.linear() * *camera.unproject({1.0 * u, 1.0 * v});
      const auto along = march(shape, T.translation(), direction);
      on_table += along && (T.translation() + *along * direction).z() < 1e-3 ? 1 : 0;
    }
  return static_cast<double>(on_table) / all;
}

// The tag lies on a table in both rooms: its plane says nothing, although it fills most of the image.
TEST_F(RoomCheckTest, AnotherRoomIsFoundAfterAWhile) {
  const DistanceField kept = kept_room(corner);
  const Isometry3d down = looking_at_tag(1.1, 40 * kDegree, -2.3, {0.1, 0.05, 0});
  EXPECT_GT(table_fraction(elsewhere, down), 0.6);
  EXPECT_GT(table_fraction(corner, down), 0.6);
  for (int i = 1; i < kKeptRoom.check.max_contradictions; ++i)
    EXPECT_EQ(look(kept, elsewhere, down), Verdict::undecided) << i;
  EXPECT_EQ(look(kept, elsewhere, down), Verdict::another);
  EXPECT_LT(check.points().on_surface, 0.5 * check.points().all());
}

TEST_F(RoomCheckTest, AVisitorInFrontOfTheCameraIsNoOtherRoom) {
  const DistanceField kept = kept_room(corner);
  for (int i = 0; i < 12; ++i) EXPECT_EQ(look(kept, visitor), Verdict::undecided) << i;
  EXPECT_LT(check.points().on_surface, 0.5 * check.points().all()) << "or the visitor is too small for this test";
  EXPECT_EQ(look(kept, corner), Verdict::same);
}

// Where nothing but the tag's plane is seen, it must do.
TEST_F(RoomCheckTest, ATableAloneIsRecognized) {
  const Isometry3d T = looking_at_tag(0.8, 20 * kDegree, -1.3);
  FusionStage stage(session_with(small_camera()), {});
  const auto kept = fuse_all(stage, frame_of(table, small_camera(), T), pose_at(T));
  EXPECT_EQ(look(*kept, table, T), Verdict::same);
}

TEST_F(RoomCheckTest, ACameraThatSeesOtherPlacesDecidesNothing) {
  const DistanceField kept = kept_room(corner);
  Isometry3d away = into_the_corner();
  away.linear() = away.linear() * Eigen::AngleAxisd(M_PI, Vector3d::UnitY()).toRotationMatrix();
  const auto ball_around = [&](const Vector3d& p) { return 2 - (p - away.translation()).norm(); };
  for (int i = 0; i < kKeptRoom.check.max_looks; ++i) {
    EXPECT_FALSE(check.sees_too_little()) << i;
    EXPECT_EQ(look(kept, ball_around, away), Verdict::undecided) << i;
  }
  EXPECT_TRUE(check.sees_too_little());
}

TEST_F(RoomCheckTest, LooksAreHalfASecondApart) {
  const DistanceField kept = kept_room(corner);
  EXPECT_EQ(look(kept, elsewhere), Verdict::undecided);
  time_ns -= kLook_ns / 2;
  EXPECT_EQ(look(kept, corner), Verdict::undecided) << "too soon";
  EXPECT_EQ(look(kept, corner), Verdict::same);
}

}  // namespace
}  // namespace lumigraft::reconstruct
