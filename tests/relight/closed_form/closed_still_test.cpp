// Invariance: pictures without virtual objects in reach, and repeated pictures.
#include <algorithm>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

/// A picture that contains every pixel value.
capture::FrameSet coded_frame(const ClosedScene& scene) {
  capture::FrameSet frame = scene.frame();
  auto color = std::make_shared<capture::Frame>();
  color->exposure = 1.3;
  color->encoded = capture::Image<std::uint8_t>(scene.width, scene.height, 3);
  for (std::size_t i = 0; i < color->encoded.data.size(); ++i) {
    color->encoded.data[i] = static_cast<std::uint8_t>(i * 7 + i / 251);
  }
  frame.color = color;
  return frame;
}

class ClosedStill : public ClosedTest {};
ON_BOTH_DEVICES(ClosedStill);

TEST_P(ClosedStill, WithoutAnObjectThePictureIsTheCameras) {
  ClosedScene scene = ball_under_lamp();
  const capture::FrameSet frame = coded_frame(scene);
  relight::Relighter relighter(device_, scene.session());
  for (int how = 0; how < 2; ++how) {
    if (how == 0) scene.exhibit.objects.front().visible = false;
    if (how == 1) scene.exhibit.objects.clear();
    const relight::RelitPicture picture = relighter.relight(frame, scene.scene(), scene.exhibit, careful_plan(32));
    EXPECT_EQ(picture.srgb.data, frame.color->encoded.data);
    EXPECT_EQ(picture.warnings.size(), 1u);
  }
}

// All passes run, but the object is tiny and 20 m behind the camera: its (r/d)² of the light is far below a pixel
// value, so every pixel's change is zero.
TEST_P(ClosedStill, AnObjectOutOfReachChangesNoBit) {
  ClosedScene scene = ball_under_lamp();
  scene.exhibit.objects.front().position_m = {0, -20, 0.12};
  const capture::FrameSet frame = coded_frame(scene);
  relight::Relighter relighter(device_, scene.session());
  for (const bool maps : {false, true}) {
    const relight::RelitPicture picture =
        relighter.relight(frame, scene.scene(), scene.exhibit, careful_plan(32), maps);
    EXPECT_EQ(picture.srgb.data, frame.color->encoded.data);
    EXPECT_TRUE(picture.warnings.empty());
    if (maps) {
      EXPECT_TRUE(std::all_of(picture.maps->delta.data.begin(), picture.maps->delta.data.end(),
                              [](float d) { return d == 0; }));
    }
  }
}

// Sums are integers and no two threads write to one location: a new relighter, one with full caches, and one that
// rendered something else in between give the same bytes.
TEST_P(ClosedStill, TheSameInputGivesTheSameBytes) {
  ClosedScene scene = ball_under_lamp();
  const capture::FrameSet frame = coded_frame(scene);
  const reconstruct::Scene still = scene.scene();
  const relight::Plan plan = careful_plan(32);
  relight::Relighter first(device_, scene.session()), second(device_, scene.session());
  const relight::RelitPicture a = first.relight(frame, still, scene.exhibit, plan, true);
  EXPECT_NE(a.srgb.data, frame.color->encoded.data);
  relight::Exhibit moved = scene.exhibit;
  moved.objects.front().position_m.x() += 0.05;
  const relight::RelitPicture b = second.relight(frame, still, moved, plan, true);
  EXPECT_NE(a.srgb.data, b.srgb.data);
  for (relight::Relighter* relighter : {&first, &second}) {
    const relight::RelitPicture again = relighter->relight(frame, still, scene.exhibit, plan, true);
    EXPECT_EQ(again.srgb.data, a.srgb.data);
    EXPECT_EQ(again.maps->delta.data, a.maps->delta.data);
    EXPECT_EQ(again.maps->albedo.data, a.maps->albedo.data);
    EXPECT_EQ(again.maps->normals.data, a.maps->normals.data);
    EXPECT_EQ(again.maps->depth_m.data, a.maps->depth_m.data);
    EXPECT_EQ(again.maps->mask.data, a.maps->mask.data);
  }
}

// Bounces under one lamp, or gathered for one plan, must not be reused for the next: after a change the bytes equal
// those of a new relighter.
TEST_P(ClosedStill, NothingStaysOfEarlierLightsAndPlans) {
  ClosedScene scene = ball_under_lamp();
  const capture::FrameSet frame = coded_frame(scene);
  const reconstruct::Scene before = scene.scene();
  scene.lamps = {lamp_at({-0.3f, 0.2f, 0.7f}, 0.05f, 0.2f)};
  scene.sky = 0.2f;
  reconstruct::Scene after = before;  // the same field: only the light is another
  after.illumination = scene.scene().illumination;
  relight::Plan live = careful_plan(32);
  live.trace_scale = 4;
  const auto expect_same = [&](const relight::RelitPicture& a, const relight::RelitPicture& b) {
    EXPECT_EQ(a.srgb.data, b.srgb.data);
    EXPECT_EQ(a.maps->delta.data, b.maps->delta.data);
  };
  for (const relight::Plan& plan : {careful_plan(32), live}) {
    relight::Relighter fresh(device_, scene.session()), used(device_, scene.session()),
        other_plan(device_, scene.session());
    const relight::RelitPicture wanted = fresh.relight(frame, after, scene.exhibit, plan, true);
    EXPECT_NE(used.relight(frame, before, scene.exhibit, plan, true).srgb.data, wanted.srgb.data);
    expect_same(used.relight(frame, after, scene.exhibit, plan, true), wanted);
    other_plan.relight(frame, after, scene.exhibit, plan.trace_scale == 4 ? careful_plan(32) : live, true);
    expect_same(other_plan.relight(frame, after, scene.exhibit, plan, true), wanted);
  }
}

}  // namespace
}  // namespace lumigraft::test
