// Animated objects on devices, against the same pose as a rigid model.
#include <algorithm>

#include "relight/parameters.h"
#include "tests/relight/closed_form/bending_bar.h"

namespace lumigraft::test {
namespace {

class ClosedAnimated : public ClosedTest {
 protected:
  relight::RelitPicture draw(relight::Relighter& relighter, double time_s, const relight::Plan& plan) const {
    return relighter.relight(at(frame_, time_s), room_, scene_.exhibit, plan);
  }
  capture::Image<std::uint8_t> draw_rigid(double time_s, const relight::Plan& plan) const {
    relight::Relighter relighter(device_, scene_.session());
    return relighter.relight(frame_, room_, rigid(scene_.exhibit, time_s), plan).srgb;
  }

  ClosedScene scene_ = bar_on_floor();
  const reconstruct::Scene room_ = scene_.scene();
  const capture::FrameSet frame_ = scene_.frame();
};
ON_BOTH_DEVICES(ClosedAnimated);

// The pose has a coarser distance field than a rigid model.
TEST_P(ClosedAnimated, EveryFrameShowsThePoseOfItsTime) {
  const relight::Plan plan = careful_plan(32);
  relight::Relighter relighter(device_, scene_.session());
  const capture::Image<std::uint8_t> straight = draw(relighter, 0, plan).srgb;
  for (const double time_s : {0.5, 1.0}) {
    const capture::Image<std::uint8_t> bent = draw(relighter, time_s, plan).srgb, wanted = draw_rigid(time_s, plan);
    EXPECT_LT(rms_of_codes(bent, wanted), 0.7) << time_s;
    EXPECT_GT(rms_of_codes(bent, straight), 2) << "it moves";
  }
}

TEST_P(ClosedAnimated, APoseThatIsHeldIsNotRenderedAgain) {
  relight::Relighter relighter(device_, scene_.session());
  const relight::Plan plan = careful_plan(32);
  const relight::RelitPicture ended = draw(relighter, 1, plan), later = draw(relighter, 2, plan);
  EXPECT_FALSE(ended.passes.empty());
  EXPECT_TRUE(later.passes.empty());
  EXPECT_EQ(later.srgb.data, ended.srgb.data);
}

TEST_P(ClosedAnimated, WithLiveSettingsItComesToRestWhereItShould) {
  relight::Relighter relighter(device_, scene_.session());
  draw(relighter, 0, live_plan());
  capture::Image<std::uint8_t> last;
  for (int i = 1; i <= 4 * relight::kRelight.round_frames; ++i) {
    const relight::RelitPicture picture = draw(relighter, 0.05 * i, live_plan());
    last = picture.srgb;
    if (i > 20 && picture.passes.empty()) break;
  }
  relight::Relighter other(device_, scene_.session());
  EXPECT_EQ(last.data, draw(other, 1, live_plan()).srgb.data);
}

TEST_P(ClosedAnimated, WhatShrinksToNothingIsNotDrawn) {
  relight::VirtualObject& bar = scene_.exhibit.objects[0];
  auto model = std::make_shared<relight::Model>(*bar.model);
  auto rig = std::make_shared<relight::Rig>(*model->rig);
  rig->animations[0].channels = {channel_of(relight::Rig::Moves::scale, 0, value_of(3, {0, 1}, {1, 1, 1, 0, 0, 0}))};
  model->rig = std::move(rig);
  bar.model = std::move(model);
  relight::Relighter relighter(device_, scene_.session());
  EXPECT_FALSE(draw(relighter, 0.5, careful_plan(32)).passed_through);
  const relight::RelitPicture gone = draw(relighter, 1, careful_plan(32));
  EXPECT_TRUE(gone.passed_through);
  EXPECT_FALSE(draw(relighter, 0, careful_plan(32)).passed_through);
}

}  // namespace
}  // namespace lumigraft::test
