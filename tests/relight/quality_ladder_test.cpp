#include "relight/quality_ladder.h"

#include <gtest/gtest.h>

namespace lumigraft::relight {
namespace {

Plan plan_of(int budget_ms) {
  Plan plan;
  plan.method = "rays";
  plan.budget_ms = budget_ms;
  return plan;
}

/// A machine on which a picture of each step takes some time, at 30 pictures a second.
class Machine {
 public:
  explicit Machine(int budget_ms, std::array<double, QualityLadder::kSteps.size()> ms)
      : asked_(plan_of(budget_ms)), ms_(ms) {}

  double slower = 1;
  bool anew = true, view_moves = false;
  int changes = 0;
  double longest_ms = 0;

  /// Index of the step after some seconds.
  std::size_t after(double seconds) {
    for (const double end_s = time_s_ + seconds; time_s_ < end_s; time_s_ += 1.0 / 30) {
      const Plan plan = ladder_.plan(asked_, view_moves, time_s_);
      const std::size_t step = step_of(plan);
      changes += step != step_ ? 1 : 0;
      const double ms = anew || step != step_ ? slower * ms_[step] : 1;
      longest_ms = std::max(longest_ms, ms);
      ladder_.took(ms, anew || step != step_);
      step_ = step;
    }
    return step_;
  }

 private:
  static std::size_t step_of(const Plan& plan) {
    for (std::size_t i = 0; i < QualityLadder::kSteps.size(); ++i) {
      if (QualityLadder::kSteps[i].trace_scale == plan.trace_scale && QualityLadder::kSteps[i].rays == plan.rays)
        return i;
    }
    ADD_FAILURE() << "a plan of no step";
    return 0;
  }

  QualityLadder ladder_;
  Plan asked_;
  std::array<double, QualityLadder::kSteps.size()> ms_;
  double time_s_ = 5;
  std::size_t step_ = 0;
};

TEST(QualityLadder, ChoosesOnlyWhatTheUserLeavesOpen) {
  EXPECT_TRUE(QualityLadder::chooses(plan_of(33)));
  EXPECT_FALSE(QualityLadder::chooses(plan_of(0)));
  for (const char* key : {"trace_scale", "rays"}) {
    Plan plan = plan_of(33);
    plan.user_set.insert(key);
    EXPECT_FALSE(QualityLadder::chooses(plan)) << key;
  }
  Plan fixed = plan_of(33);
  fixed.adaptive = 0;
  EXPECT_FALSE(QualityLadder::chooses(fixed));
  Plan cones = plan_of(33);
  cones.method = "dvct";
  EXPECT_FALSE(QualityLadder::chooses(cones));
}

TEST(QualityLadder, FindsTheBestStepWithinTheBudget) {
  EXPECT_EQ(Machine(33, {10, 13, 20, 45, 70}).after(20), 2u);
  EXPECT_EQ(Machine(33, {50, 60, 80, 150, 300}).after(20), 0u);
  EXPECT_EQ(Machine(100, {10, 13, 20, 45, 70}).after(20), 4u);
}

// The second step takes four times as long as the first here, which is unknown until it is measured.
TEST(QualityLadder, AStepThatIsTooSlowIsTriedOnceInAWhile) {
  Machine machine(33, {20, 80, 90, 100, 110});
  EXPECT_EQ(machine.after(120), 0u);
  EXPECT_LE(machine.changes, 4) << "what was measured is remembered";
}

TEST(QualityLadder, FollowsALoadAndRecovers) {
  Machine machine(33, {5, 7, 11, 24, 60});
  EXPECT_EQ(machine.after(20), 3u);
  machine.slower = 4;
  EXPECT_LE(machine.after(0.5), 1u) << "more than one step at once";
  machine.slower = 1;
  EXPECT_EQ(machine.after(100), 3u);
}

TEST(QualityLadder, StallsChangeNothing) {
  Machine machine(33, {5, 7, 11, 24, 60});
  ASSERT_EQ(machine.after(20), 3u);
  machine.changes = 0;
  for (int i = 0; i < 10; ++i) {
    machine.slower = 20;
    machine.after(0.03);
    machine.slower = 1;
    machine.after(1);
  }
  EXPECT_EQ(machine.changes, 0);
}

TEST(QualityLadder, AMovingViewHasItsOwnStep) {
  Machine machine(33, {5, 7, 11, 24, 30});
  ASSERT_EQ(machine.after(30), 3u) << "the last leaves no margin";
  machine.view_moves = true;
  machine.slower = 3;
  machine.after(0.04);
  EXPECT_LE(machine.after(20), 1u);
  machine.view_moves = false;
  machine.slower = 1;
  EXPECT_EQ(machine.after(0.1), 3u) << "as before";
}

TEST(QualityLadder, AtRestItGoesUpAsLongAsOnePictureIsNoPause) {
  Machine machine(33, {20, 30, 50, 100, 150});
  ASSERT_LE(machine.after(5), 1u);
  machine.anew = false;
  EXPECT_EQ(machine.after(60), 4u);
  EXPECT_LE(machine.longest_ms, 200);
  machine.anew = true;
  EXPECT_LE(machine.after(2), 1u) << "the object turns again";

  Machine slow(33, {40, 60, 150, 400, 700});
  slow.after(5);
  slow.anew = false;
  EXPECT_EQ(slow.after(60), 2u);
}

}  // namespace
}  // namespace lumigraft::relight
