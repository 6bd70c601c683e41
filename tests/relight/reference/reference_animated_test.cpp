// Animated objects with the reference, which must not see a difference to the same pose as a rigid model.
#include "relight/reference/reference_renderer.h"
#include "tests/relight/closed_form/bending_bar.h"

namespace lumigraft::test {
namespace {

TEST(ReferenceAnimated, IsThatOfTheRigidPose) {
  ClosedScene scene = bar_on_floor();
  const reconstruct::Scene room = scene.scene();
  const capture::FrameSet frame = scene.frame();
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = 2;
  for (const bool emits : {false, true}) {
    if (emits) scene.exhibit.objects[0].material.emission = Eigen::Vector3f(1, 0.5f, 0);
    relight::ReferenceRenderer renderer(scene.session()), other(scene.session());
    const auto straight = renderer.relight(at(frame, 0), room, scene.exhibit, plan).srgb;
    const auto bent = renderer.relight(at(frame, 0.7), room, scene.exhibit, plan).srgb;
    EXPECT_EQ(bent.data, other.relight(frame, room, rigid(scene.exhibit, 0.7), plan).srgb.data);
    EXPECT_GT(rms_of_codes(bent, straight), 2) << "it moves";
  }
}

}  // namespace
}  // namespace lumigraft::test
