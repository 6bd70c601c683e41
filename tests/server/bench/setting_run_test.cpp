#include "server/bench/setting_run.h"

#include <gtest/gtest.h>

#include <numbers>

namespace lumigraft::server {
namespace {

TEST(BenchRun, ObjectsTurnAboutTheirOwnVertical) {
  relight::Exhibit exhibit;
  exhibit.objects.resize(2);
  exhibit.objects[0].position_m = {0.3, 0.1, 0.2};
  exhibit.objects[0].rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX());
  exhibit.objects[1].motion = {{1.0, {0.1, 0, 0}, Eigen::Quaterniond::Identity()},
                               {2.0, {0.2, 0, 0}, Eigen::Quaterniond::Identity()}};
  const relight::Exhibit quarter = turned(exhibit, std::numbers::pi / 2);
  const Eigen::Affine3d before = exhibit.objects[0].T_tag_model(0), after = quarter.objects[0].T_tag_model(0);
  EXPECT_TRUE(after.translation().isApprox(before.translation()));
  const Eigen::Vector3d x = before.linear() * Eigen::Vector3d::UnitX();
  EXPECT_TRUE((after.linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d(-x.y(), x.x(), x.z())));
  const Eigen::Affine3d moving = quarter.objects[1].T_tag_model(1.5);
  EXPECT_TRUE(moving.translation().isApprox(Eigen::Vector3d(0.15, 0, 0)));
  EXPECT_TRUE((moving.linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
}

// A rotation by 0 must be exact, or cached results of static objects would be recomputed.
TEST(BenchRun, NoTurnIsExactlyNone) {
  relight::Exhibit exhibit;
  exhibit.objects.resize(1);
  exhibit.objects[0].rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  EXPECT_EQ(turned(exhibit, 0).objects[0].rotation.coeffs(), exhibit.objects[0].rotation.coeffs());
}

/// Draws nothing, and says what it took.
class TimedRenderer : public relight::Renderer {
 public:
  relight::RelitPicture relight(const capture::FrameSet&, const reconstruct::Scene&, const relight::Exhibit&,
                                const relight::Plan&, bool) override {
    relight::RelitPicture picture;
    ++frames_;
    picture.passes = {{"gather", 1.0}, {"compose", frames_ % 2 == 0 ? 3.0 : 5.0}, {"gather", 0.5}};
    return picture;
  }

 private:
  int frames_ = 0;
};

TEST(BenchRun, ThePassesOfAFrameAreMeans) {
  TimedRenderer renderer;
  relight::Plan plan;
  plan.method = "rays";
  const FrameCost cost = cost_of_turning(renderer, {}, {}, {}, plan, true);
  ASSERT_EQ(cost.passes.size(), 2u);
  EXPECT_EQ(cost.passes[0].name, "gather");
  EXPECT_DOUBLE_EQ(cost.passes[0].gpu_ms, 1.5);
  EXPECT_EQ(cost.passes[1].name, "compose");
  EXPECT_NEAR(cost.passes[1].gpu_ms, 4, 0.5);
  EXPECT_NEAR(*cost.gpu_ms, cost.passes[0].gpu_ms + cost.passes[1].gpu_ms, 1e-9);
}

}  // namespace
}  // namespace lumigraft::server
