// Tags that are moved while other tags and the camera stay, without depth.
#include "reconstruct/pose/moved_tags.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/pose/tag_table.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using test::kSecondTag;
using test::lying_at;

constexpr std::uint64_t kMoved = 12, kEnd = 40;

/// A table on which one of two tags is moved in frame kMoved. The camera rests.
struct MovingTable {
  bool first_is_moved = true;
  Isometry3d push = lying_at({-0.05, 0.02, 0}, 0.1);  ///< of the moved tag, in the world
  const Isometry3d truth = test::above_the_table(0);

  capture::FrameSet frame(std::uint64_t index) const {
    test::TagTable table;
    const bool moved = index >= kMoved;
    if (!moved || !first_is_moved) {
      if (moved) table.T_tag_second = push * kSecondTag;
      return table.seen_from(truth, index);
    }
    table.T_tag_second = push.inverse() * kSecondTag;  // the table's frame is that of the first tag
    return table.seen_from(push.inverse() * truth, index);
  }
};

bool warns_of(const PoseStage::Result& result, const std::string& text) {
  return std::ranges::any_of(result.warnings, [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

class MovedTagOfTwo : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(FirstOrSecond, MovedTagOfTwo, testing::Bool());

TEST_P(MovedTagOfTwo, MovesNoCameraAndIsKnownAtItsNewPlace) {
  MovingTable table;
  table.first_is_moved = GetParam();
  const char* moved = GetParam() ? "tag 2" : "tag 5";
  for (const bool follows : {false, true}) {
    capture::Tag tag{"tag36h11", 2, 0.16, {{5, 0.16, kSecondTag}}};
    tag.moves_exhibit = follows;
    PoseStage stage(tag, test::small_camera());
    PoseStage::Result result;
    for (std::uint64_t i = 0; i < kEnd; ++i) {
      result = stage.locate(table.frame(i));
      ASSERT_TRUE(result.pose) << i;
      EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera_raw, table.truth), 4) << i;
      if (i < kMoved) {
        EXPECT_TRUE(result.warnings.empty()) << i << result.warnings.front();
      }
      if (i >= kMoved) {
        EXPECT_TRUE(warns_of(result, moved)) << i;
      }
    }
    EXPECT_TRUE(warns_of(result, std::string(moved) + ": it was moved by"));
    const bool taken = follows && GetParam();
    const Isometry3d expected = taken ? table.push : Isometry3d::Identity();
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_exhibit, expected), 4);
    EXPECT_EQ(warns_of(result, "objects moved with it"), taken);
  }
}

// On someone's shirt it never rests.
TEST_P(MovedTagOfTwo, ThatGoesOnMovingIsNeverUsed) {
  MovingTable table;
  table.first_is_moved = GetParam();
  PoseStage stage({"tag36h11", 2, 0.16, {{5, 0.16, kSecondTag}}}, test::small_camera());
  for (std::uint64_t i = 0; i < kEnd; ++i) {
    const double carried_m = 0.004 * static_cast<double>(std::max(i, kMoved) - kMoved);
    table.push = lying_at({-carried_m, 0.4 * carried_m, 0}, 0);
    const auto result = stage.locate(table.frame(i));
    ASSERT_TRUE(result.pose) << i;
    // Until it is clear which of both moves.
    const bool contradicting = warns_of(result, "contradicts the others, left out");
    const double limit_mm = i >= kMoved + 8 ? 4 : contradicting ? 25 : 6;
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera_raw, table.truth), limit_mm) << i;
    if (i >= kMoved + 8) {
      EXPECT_TRUE(warns_of(result, "contradicts the others, left out")) << i;
    }
    EXPECT_FALSE(warns_of(result, "it was moved")) << i;
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
