// Cached results that are reused because their inputs did not change: they must equal the picture of a new relighter,
// or differ by a stated bound.
#include <algorithm>
#include <cmath>
#include <random>

#include "relight/static_view_cache.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

ClosedScene ball_on_floor() {
  ClosedScene scene;
  scene.width = 160;
  scene.height = 120;
  scene.focal_px = 130;
  scene.sky = 0.3f;
  scene.lamps = {lamp_at({0.25f, 0.1f, 0.6f}, 0.03f, 0.2f)};
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 0.7f)};
  return scene;
}

/// A picture with camera noise and quantisation.
capture::FrameSet noisy(const capture::FrameSet& frame, unsigned seed, float sigma_codes, float sigma_m) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  capture::FrameSet result = frame;
  auto color = std::make_shared<capture::Frame>();
  color->exposure = 1;
  color->encoded = capture::Image<std::uint8_t>(frame.color->radiance.width, frame.color->radiance.height, 3);
  for (std::size_t i = 0; i < color->encoded.data.size(); ++i) {
    const float linear = std::clamp(frame.color->radiance.data[i], 0.0f, 1.0f);
    const float code = 255 * (1.055f * std::pow(std::max(linear, 0.004f), 1 / 2.4f) - 0.055f);
    color->encoded.data[i] = static_cast<std::uint8_t>(std::clamp(code + sigma_codes * normal(random), 0.0f, 255.0f));
  }
  result.color = color;
  auto depth = std::make_shared<capture::DepthFrame>(*frame.depth);
  for (float& z : depth->depth_m.data) z = z > 0 ? z + sigma_m * normal(random) : 0;
  result.depth = depth;
  return result;
}

double rms_codes(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += (a.data[i] - b.data[i]) * (a.data[i] - b.data[i]);
  return std::sqrt(sum / static_cast<double>(a.data.size()));
}

class ClosedKept : public ClosedTest {
 protected:
  capture::Image<std::uint8_t> fresh(const ClosedScene& scene, const capture::FrameSet& frame,
                                     const relight::Plan& plan) const {
    return relight::Relighter(device_, scene.session()).relight(frame, scene.scene(), scene.exhibit, plan).srgb;
  }
};
ON_BOTH_DEVICES(ClosedKept);

TEST_P(ClosedKept, WhatIsStillTakesNoPass) {
  const ClosedScene scene = ball_on_floor();
  const capture::FrameSet frame = noisy(scene.frame(), 1, 0, 0);
  const reconstruct::Scene still = scene.scene();
  for (const relight::Plan& plan : {live_plan(), careful_plan(32)}) {
    relight::Relighter relighter(device_, scene.session());
    const relight::RelitPicture first = relighter.relight(frame, still, scene.exhibit, plan);
    EXPECT_FALSE(first.passes.empty());
    EXPECT_NE(first.srgb.data, frame.color->encoded.data);
    const relight::RelitPicture again = relighter.relight(frame, still, scene.exhibit, plan);
    EXPECT_TRUE(again.passes.empty());
    EXPECT_FALSE(again.passed_through);
    EXPECT_EQ(again.srgb.data, first.srgb.data);
  }
}

// Another picture of the same view: only the camera's noise differs. The cached factor is applied to the new picture.
TEST_P(ClosedKept, NoiseOfTheCameraIsNoReasonToDrawAgain) {
  const ClosedScene scene = ball_on_floor();
  const reconstruct::Scene still = scene.scene();
  const capture::FrameSet one = noisy(scene.frame(), 1, 1.5f, 0.002f), two = noisy(scene.frame(), 2, 1.5f, 0.002f);
  for (const relight::Plan& plan : {live_plan(), careful_plan(32)}) {
    relight::Relighter relighter(device_, scene.session());
    relighter.relight(one, still, scene.exhibit, plan);
    const relight::RelitPicture picture = relighter.relight(two, still, scene.exhibit, plan);
    EXPECT_LE(picture.passes.size(), plan.trace_scale == 4 ? 0u : 1u);
    EXPECT_LT(rms_codes(picture.srgb, fresh(scene, two, plan)), 0.35);
  }
}

// A hand in front of the camera covers a corner of the floor next to the ball: only these blocks are rendered again.
TEST_P(ClosedKept, WhatEntersTheViewIsDrawn) {
  const ClosedScene scene = ball_on_floor();
  const capture::FrameSet before = noisy(scene.frame(), 1, 0, 0);
  capture::FrameSet after = before;
  auto color = std::make_shared<capture::Frame>(*before.color);
  auto depth = std::make_shared<capture::DepthFrame>(*before.depth);
  for (int v = 60; v < 90; ++v) {
    for (int u = 60; u < 100; ++u) {
      depth->depth_m.at(u, v) = 0.3f;
      for (int c = 0; c < 3; ++c) color->encoded.at(u, v, c) = 90;
    }
  }
  after.color = color;
  after.depth = depth;
  const relight::Plan plan = live_plan();
  const reconstruct::Scene still = scene.scene();
  relight::Relighter relighter(device_, scene.session());
  const auto first = relighter.relight(before, still, scene.exhibit, plan);
  const auto with_hand = relighter.relight(after, still, scene.exhibit, plan);
  const auto wanted = fresh(scene, after, plan);
  EXPECT_GT(rms_codes(with_hand.srgb, first.srgb), 3);
  EXPECT_LT(rms_codes(with_hand.srgb, wanted), 0.1);  // normals from depth reach into adjacent blocks
  EXPECT_LT(rms_codes(relighter.relight(before, still, scene.exhibit, plan).srgb, first.srgb), 0.1);
}

TEST_P(ClosedKept, ACameraThatTremblesIsStillAndOneThatMovesIsNot) {
  const ClosedScene scene = ball_on_floor();
  const capture::FrameSet frame = noisy(scene.frame(), 1, 0, 0);
  const reconstruct::Scene still = scene.scene();
  const auto moved = [&](double by_m) {
    reconstruct::Scene result = still;
    result.pose->T_tag_camera.translation().x() += by_m;
    return result;
  };
  const relight::Plan plan = live_plan();
  relight::Relighter relighter(device_, scene.session());
  relighter.relight(frame, still, scene.exhibit, plan);
  for (const double by_m : {0.0005, 0.004}) {  // of about 0.9 m: 0.07 and 0.6 pixels
    const reconstruct::Scene now = moved(by_m);
    const relight::RelitPicture picture = relighter.relight(frame, now, scene.exhibit, plan);
    const auto wanted = relight::Relighter(device_, scene.session()).relight(frame, now, scene.exhibit, plan).srgb;
    EXPECT_EQ(picture.passes.empty(), by_m < 0.001);
    EXPECT_LT(rms_codes(picture.srgb, wanted), by_m < 0.001 ? 0.6 : 1e-9);
  }
}

TEST_P(ClosedKept, WhatChangesInBetweenLeavesNoTrace) {
  const ClosedScene scene = ball_on_floor();
  ClosedScene other = scene;
  other.lamps = {lamp_at({-0.3f, 0.2f, 0.5f}, 0.03f, 0.2f)};
  other.exhibit.objects.front().position_m.x() += 0.04;
  const capture::FrameSet frame = noisy(scene.frame(), 1, 0, 0);
  const reconstruct::Scene still = scene.scene();
  reconstruct::Scene lit = still;
  lit.illumination = other.scene().illumination;
  reconstruct::Scene closed = still;  // by a ceiling
  closed.enclosure = std::make_shared<const reconstruct::Enclosure>(
      reconstruct::Enclosure{{{{0, 0, 1}, 0, true}, {{0, 0, -1}, 0.7f, false}}, Eigen::Vector3f(0, 0, 0.3f)});
  const relight::Plan plan = live_plan();
  relight::Relighter relighter(device_, scene.session());
  const auto first = relighter.relight(frame, still, scene.exhibit, plan).srgb;
  EXPECT_NE(relighter.relight(frame, closed, scene.exhibit, plan).srgb.data, first.data);
  EXPECT_NE(relighter.relight(frame, lit, scene.exhibit, plan).srgb.data, first.data);
  EXPECT_NE(relighter.relight(frame, still, other.exhibit, plan).srgb.data, first.data);
  relight::Exhibit none = scene.exhibit;
  none.objects.front().visible = false;
  EXPECT_EQ(relighter.relight(frame, still, none, plan).srgb.data, frame.color->encoded.data);
  relighter.relight(frame, still, scene.exhibit, careful_plan(32));
  relighter.relight(frame, still, scene.exhibit, plan, true);
  EXPECT_EQ(relighter.relight(frame, still, scene.exhibit, plan).srgb.data, first.data);
}

TEST(StaticViewCache, HoldsThePoseUpToAnEighthOfAPixel) {
  capture::CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 500;
  camera.cx = 319.5;
  camera.cy = 239.5;
  relight::StaticViewCache view(camera);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  bool moved = false;
  view.hold(pose, 1.0, &moved);
  EXPECT_TRUE(moved);
  pose.translation().x() = 0.00015;  // of 0.8 m in the corners: 0.1 pixels
  EXPECT_EQ(view.hold(pose, 1.0, &moved).translation().x(), 0);
  EXPECT_FALSE(moved);
  pose.translation().x() = 0.0003;
  EXPECT_EQ(view.hold(pose, 1.0, &moved).translation().x(), 0.0003);
  EXPECT_TRUE(moved);
  pose.rotate(Eigen::AngleAxisd(0.0003, Eigen::Vector3d::UnitZ()));  // 0.12 pixels in the corners
  view.hold(pose, 1.0, &moved);
  EXPECT_FALSE(moved);
  pose.rotate(Eigen::AngleAxisd(0.0001, Eigen::Vector3d::UnitZ()));
  view.hold(pose, 1.0, &moved);
  EXPECT_TRUE(moved) << "small steps add up";
}

}  // namespace
}  // namespace lumigraft::test
