// Shadows on surfaces in which the camera clips.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "relight/reference/reference_renderer.h"
#include "relight/views/live_ray_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/clipping_camera.h"

namespace lumigraft::test {
namespace {

TEST(ClippedPixels, ShadowsHaveTheDepthThatTheLightGivesThem) {
  relight::RayRenderer unlimited(bright_floor().session()), clipping(bright_floor().session());
  const ClippedShadow shadow = clipped_shadow(unlimited, clipping, rays_plan(1, 64));
  EXPECT_GT(shadow.shadowed, 50);
  EXPECT_LT(shadow.error, 0.1);
  EXPECT_EQ(shadow.brightest_changed, 0) << "beyond the shadow white stays white";
}

TEST(ClippedPixels, SoByTheReference) {
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = 64;
  relight::ReferenceRenderer unlimited(bright_floor().session()), clipping(bright_floor().session());
  const ClippedShadow shadow = clipped_shadow(unlimited, clipping, plan);
  EXPECT_GT(shadow.shadowed, 50);
  EXPECT_LT(shadow.error, 0.1);
  EXPECT_EQ(shadow.brightest_changed, 0);
}

class ClippedPixelsOn : public ClosedTest {};
ON_BOTH_DEVICES(ClippedPixelsOn);

TEST_P(ClippedPixelsOn, SoByTheFullSettings) {
  for (const int trace_scale : {1, 2}) {
    for (const char* method : {"dvct", "dlpv"}) {
      SCOPED_TRACE(method);
      relight::Plan plan = careful_plan();
      plan.method = method;
      plan.trace_scale = trace_scale;
      relight::Relighter unlimited(device_, bright_floor().session()), clipping(device_, bright_floor().session());
      const ClippedShadow shadow = clipped_shadow(unlimited, clipping, plan);
      EXPECT_GT(shadow.shadowed, 50);
      EXPECT_LT(shadow.error, 0.1);
      EXPECT_EQ(shadow.brightest_changed, 0);
    }
  }
}

TEST(ClippedPixels, ChannelsThatDoNotClipCorrectTheOthers) {
  // The albedo that is known is a quarter too high.
  ClosedScene scene = bright_floor();
  scene.radiance = [of_albedo = scene.radiance](const Eigen::Vector3f& p) { return 0.8f * of_albedo(p); };
  const capture::FrameSet linear = scene.frame();
  const std::vector<float>& light = linear.color->radiance.data;
  const float exposure = 1.6f / *std::max_element(light.begin(), light.end());
  const std::array<float, 3> gain = {1, 0.6f, 0.5f};
  const capture::FrameSet frame = encoded(linear, exposure, gain);
  relight::RayRenderer renderer(scene.session());
  const relight::RelitPicture picture =
      renderer.relight(frame, with_bounds(scene.scene(), 1 / exposure), scene.exhibit, rays_plan(1, 64), true);
  int shadowed = 0;
  double error = 0;
  for (std::size_t i = 0; i < light.size(); i += 3) {
    const auto left = [&](std::size_t c) {
      const float shown = capture::srgb_to_linear(static_cast<float>(picture.srgb.data[i + c]) / 255);
      return shown / (exposure * gain[c] * light[i + c]);
    };
    if (frame.color->encoded.data[i] < 250 || picture.maps->mask.data[i / 3] > 0 || left(1) > 0.85f) continue;
    error += std::abs(left(0) / left(1) - 1);
    ++shadowed;
  }
  ASSERT_GT(shadowed, 20);
  EXPECT_LT(error / shadowed, 0.05) << "of the same shadow in another channel";
}

TEST(ClippedPixels, FollowTheLight) {
  ClosedScene scene = bright_floor();
  const reconstruct::Scene before = scene.scene();
  const float brightest = [&] {
    const capture::FrameSet frame = scene.frame();
    return *std::max_element(frame.color->radiance.data.begin(), frame.color->radiance.data.end());
  }();
  const float exposure = 0.97f / brightest;
  // As where rooms are made in the background: light changes before the room does.
  const auto models = std::make_shared<relight::RayModels>(relight::make_ray_model);
  models->prepare_next(scene.exhibit);
  relight::LiveRayRenderer renderer(scene.session(), models);
  renderer.take(renderer.room_of(before));
  renderer.relight(encoded(scene.frame(), exposure), before, scene.exhibit, rays_plan(2));
  // The lamp becomes three times as strong: now the floor clips.
  scene.lamps[0].intensity *= 3;
  scene.lamps[0].irradiance *= 3;
  scene.radiance = [scene](const Eigen::Vector3f& p) {
    const float sky = static_cast<float>(M_PI) * scene.sky;
    return scene.albedo / static_cast<float>(M_PI) * (sky + irradiance(scene.lamps[0], p, Eigen::Vector3f::UnitZ()));
  };
  reconstruct::Scene after = before;
  after.illumination = scene.scene().illumination;
  const capture::FrameSet frame = encoded(scene.frame(), exposure);
  const auto kept = renderer.relight(frame, after, scene.exhibit, rays_plan(2));
  relight::LiveRayRenderer fresh(scene.session(), models);
  fresh.take(fresh.room_of(before));
  const auto anew = fresh.relight(frame, after, scene.exhibit, rays_plan(2));
  relight::RayRenderer with_maps(scene.session());
  const auto maps = with_maps.relight(frame, after, scene.exhibit, rays_plan(2), true).maps;
  std::vector<int> off;  // of shadowed pixels that clip
  for (std::size_t i = 0; i < anew.srgb.data.size(); ++i) {
    const bool shadowed = std::min(kept.srgb.data[i], anew.srgb.data[i]) < 245;
    if (frame.color->encoded.data[i] < 250 || maps->mask.data[i / 3] > 0 || !shadowed) continue;
    off.push_back(std::abs(kept.srgb.data[i] - anew.srgb.data[i]));
  }
  ASSERT_GT(off.size(), 100u);
  // Next to the object some are farther off: by its indirect light, which is stored.
  std::sort(off.begin(), off.end());
  EXPECT_LE(off[off.size() / 2], 2);
}

// The floor clips until the exposure is lower: then the picture shows its albedo.
TEST(ClippedPixels, FollowTheExposure) {
  const ClosedScene scene = bright_floor();
  const reconstruct::Scene room = scene.scene();
  const capture::FrameSet linear = scene.frame();
  const std::vector<float>& light = linear.color->radiance.data;
  const float exposure = 0.9f / *std::max_element(light.begin(), light.end());
  const capture::FrameSet clipped = encoded(linear, exposure, {2, 2, 2}), whole = encoded(linear, exposure);
  relight::RayRenderer renderer(scene.session()), fresh(scene.session());
  renderer.relight(clipped, room, scene.exhibit, rays_plan(1, 64), true);
  const auto kept = renderer.relight(whole, room, scene.exhibit, rays_plan(1, 64), true);
  const auto anew = fresh.relight(whole, room, scene.exhibit, rays_plan(1, 64), true);
  EXPECT_EQ(kept.maps->albedo.data, anew.maps->albedo.data);
}

}  // namespace
}  // namespace lumigraft::test
