// Live pictures by rays of an object that bends, with the light of an earlier pose.
#include <algorithm>

#include "relight/views/live_ray_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/bending_bar.h"

namespace lumigraft::test {
namespace {

TEST(LiveRaysAnimated, APoseIsShownAtOnceWithTheLightOfTheOneBefore) {
  const ClosedScene scene = bar_on_floor();
  const reconstruct::Scene room = scene.scene();
  const capture::FrameSet frame = scene.frame();
  const auto models = std::make_shared<relight::RayModels>(relight::make_ray_model);
  while (models->wants(scene.exhibit)) models->prepare_next(scene.exhibit);
  relight::LiveRayRenderer renderer(scene.session(), models);
  renderer.take(renderer.room_of(room));
  relight::Plan plan = rays_plan(8);
  relight::RelitPicture straight;
  for (int k = 0; k < 60; ++k) straight = renderer.relight(at(frame, 0), room, scene.exhibit, plan);
  plan.budget_ms = 1;
  const relight::RelitPicture bent = renderer.relight(at(frame, 1), room, scene.exhibit, plan);
  ASSERT_TRUE(std::ranges::any_of(bent.passes, [](const auto& pass) { return pass.name == "reproject objects"; }));
  relight::RayRenderer other(scene.session());
  const capture::Image<std::uint8_t> wanted = other.relight(at(frame, 1), room, scene.exhibit, rays_plan(8)).srgb;
  const double moved = rms_of_codes(straight.srgb, wanted);
  EXPECT_GT(moved, 2) << "it bends";
  EXPECT_LT(rms_of_codes(bent.srgb, wanted), 0.6 * moved) << "its shadow is late";
}

}  // namespace
}  // namespace lumigraft::test
