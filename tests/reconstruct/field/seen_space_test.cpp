// What a depth image of a board in front of a wall hides.
#include "reconstruct/field/seen_space.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr int kWidth = 160, kHeight = 120;
constexpr float kFocal = 130, kVoxel_m = 0.008f, kWall_m = 2, kBoard_m = 1;

/// From the origin along z: a wall, and where |x/z| is below `half_tangent` a board.
SeenSpace view_of_board(float half_tangent, float hole_tangent = 0, float slope = 0) {
  std::vector<Eigen::Vector2f> rays;
  std::vector<float> inverse;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Eigen::Vector2f ray((static_cast<float>(u) - 79.5f) / kFocal, (static_cast<float>(v) - 59.5f) / kFocal);
      const float x = std::abs(ray.x());
      rays.push_back(ray);
      inverse.push_back(x < hole_tangent ? 0 : x < half_tangent ? 1 / kBoard_m : (1 + slope * ray.y()) / kWall_m);
    }
  }
  return {rays, inverse, kWidth, Eigen::Isometry3f::Identity(), kVoxel_m};
}

TEST(SeenSpace, HidesWhatIsBehindASurface) {
  const SeenSpace view = view_of_board(0.2f);
  EXPECT_EQ(view.hides({0, 0, 0.9f}), false);
  EXPECT_EQ(view.hides({0, 0, 1.1f}), true);
  EXPECT_EQ(view.hides({0, 0, 1.9f}), true);
  EXPECT_EQ(view.hides({0.5f, 0, 1.5f}), false);
  EXPECT_EQ(view.hides({0.5f, 0, 2.1f}), true);
}

TEST(SeenSpace, SaysNothingOfWhatIsOutsideTheImage) {
  const SeenSpace view = view_of_board(0.2f);
  EXPECT_EQ(view.hides({0, 0, -1}), std::nullopt);
  EXPECT_EQ(view.hides({2, 0, 1}), std::nullopt);
  EXPECT_EQ(view_of_board(0.2f, 0.1f).hides({0, 0, 1.5f}), std::nullopt) << "nothing was measured there";
}

// An edge of less than a pixel hides a sheet of about two cells.
TEST(SeenSpace, ThinEdgesHideASheetBehindThem) {
  const SeenSpace view = view_of_board(0.6f / kFocal);
  EXPECT_EQ(view.hides({0, 0, 0.9f}), false);
  EXPECT_EQ(view.hides({0, 0, 1.5f}), true);
  EXPECT_EQ(view.hides({1.5f * 2 / kFocal, 0, 1.5f}), true);
  EXPECT_EQ(view.hides({1.5f * 7 / kFocal, 0, 1.5f}), false);
}

TEST(SeenSpace, ASlopeIsNoEdge) {
  const SeenSpace view = view_of_board(0, 0, 1.5f);  // per cell 2.3 % of the depth
  const float y = 0.1f, wall_m = kWall_m / (1 + 1.5f * y);
  EXPECT_EQ(view.hides({0, (wall_m - 0.08f) * y, wall_m - 0.08f}), false);
  EXPECT_EQ(view.hides({0, (wall_m + 0.08f) * y, wall_m + 0.08f}), true);
}

TEST(SeenSpace, OneCameraThatSeesThroughIsEnough) {
  const auto hidden = std::make_shared<const SeenSpace>(view_of_board(0.2f));
  const auto open = std::make_shared<const SeenSpace>(view_of_board(0));
  const Vector3f behind(0, 0, 1.5f), outside(0, 0, -1);
  EXPECT_TRUE(hidden_from_all({hidden}, behind));
  EXPECT_FALSE(hidden_from_all({hidden, open}, behind));
  EXPECT_FALSE(hidden_from_all({}, behind));
  EXPECT_FALSE(hidden_from_all({hidden}, outside));
}

}  // namespace
}  // namespace lumigraft::reconstruct
