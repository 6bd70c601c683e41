// Fish-eyes whose configured pose is wrong.
#include "reconstruct/light/extrinsics_check.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "capture/source.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/light/light_views.h"

namespace lumigraft::reconstruct {
namespace {

class RigSessions : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string name = GetParam();
    const char* extra = std::getenv("LUMIGRAFT_EXTRA");
    const std::filesystem::path folder = name == "recording"
                                             ? std::filesystem::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop"
                                             : std::filesystem::path(extra ? extra : "") / "sessions" / name;
    if (!extra && name != "recording") GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions/" << name;
    session_ = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
    const auto frames = capture::open_frames(session_);
    PoseStage locate(session_.tag, session_.color.model, session_.color.response);
    FusionStage fuse(session_, {});
    for (int i = 0; i < 2; ++i) {
      frame_ = frames->next(std::chrono::seconds(1));
      ASSERT_TRUE(frame_);
      const auto pose = locate.locate(*frame_).pose;
      ASSERT_TRUE(pose);
      field_ = fuse.fuse(*frame_, *pose);
    }
    rays_.emplace(*field_);
    metal_.emplace(session_);
  }

  /// With the configured pose turned about an axis of the fish-eye and shifted.
  std::optional<ExtrinsicsError> error(const Eigen::Vector3d& axis, double degrees, const Eigen::Vector3d& shift_m) {
    capture::Session configured = session_;
    Eigen::Isometry3d& T = configured.fisheye->T_tag_fisheye;
    T.linear() = T.linear() * Eigen::AngleAxisd(degrees * kDegree, axis).toRotationMatrix();
    T.translation() += shift_m;
    const auto light = LightStage(configured).extract(*frame_).illumination;
    const std::clock_t start = std::clock();
    const auto found = extrinsics_error(*field_, *rays_, *metal_, *light, *configured.fisheye);
    std::printf("rig: %-16s turned %5.1f, moved %4.1f cm: ", GetParam(), degrees, 100 * shift_m.norm());
    std::printf(found ? "found %.1f, %.1f cm" : "agrees", found ? found->turn_degrees : 0,
                found ? 100 * found->shift_m : 0);
    std::printf(", %.0f CPU ms\n", 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    return found;
  }

  capture::Session session_;
  std::optional<capture::FrameSet> frame_;
  std::shared_ptr<const DistanceField> field_;
  std::optional<FieldRays> rays_;
  std::optional<MetalMask> metal_;
};

TEST_P(RigSessions, ARightRigAgreesAndAWrongOneIsFound) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ(), nowhere(0, 0, 0);
  EXPECT_FALSE(error(z, 0, nowhere));
  // Seconds each: every error in two rooms, the smallest turn and a shift in the others.
  const std::string name = GetParam();
  const bool every_error = name == "recording" || name == "cornell";
  for (const double degrees : every_error ? std::vector{8.0, -25.0, 180.0} : std::vector{8.0}) {
    const auto found = error(z, degrees, nowhere);
    ASSERT_TRUE(found) << degrees;
    EXPECT_NEAR(found->turn_degrees, std::abs(degrees), 6);
  }
  if (every_error) {
    const auto tilted = error(x, 15, nowhere);
    ASSERT_TRUE(tilted);
    EXPECT_NEAR(tilted->turn_degrees, 15, 6);
  }
  if (name == "box-with-inside") return;  // a uniform floor looks the same from everywhere
  const auto moved = error(z, 0, {0.12, 0.12, 0.05});
  ASSERT_TRUE(moved);
  EXPECT_NEAR(moved->shift_m, 0.18, 0.1);
}

INSTANTIATE_TEST_SUITE_P(All, RigSessions,
                         testing::Values("recording", "tabletop", "cornell", "box-with-inside", "brushed-metal",
                                         "tabletop-orbit"));

}  // namespace
}  // namespace lumigraft::reconstruct
