// Shadows on surfaces in which the camera clips.
#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/camera/srgb.h"
#include "relight/gather/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

/// A box on a bright floor under a lamp.
ClosedScene bright_floor() {
  ClosedScene scene = box_on_floor();
  scene.albedo = 0.8f;
  scene.radiance = [scene](const Eigen::Vector3f& p) {
    const float sky = static_cast<float>(M_PI) * scene.sky;
    return scene.albedo / static_cast<float>(M_PI) * (sky + irradiance(scene.lamps[0], p, Eigen::Vector3f::UnitZ()));
  };
  return scene;
}

/// The frame as a camera that clips takes it.
capture::FrameSet encoded(capture::FrameSet frame, float exposure) {
  auto color = std::make_shared<capture::Frame>();
  const capture::Image<float>& light = frame.color->radiance;
  color->exposure = exposure;
  color->encoded = capture::Image<std::uint8_t>(light.width, light.height, 3);
  for (std::size_t i = 0; i < light.data.size(); ++i)
    color->encoded.data[i] =
        static_cast<std::uint8_t>(std::lround(255 * capture::linear_to_srgb(exposure * light.data[i])));
  frame.color = std::move(color);
  return frame;
}

/// Where the radiance clips, the field has a lower bound.
reconstruct::Scene with_bounds(reconstruct::Scene scene, float clip) {
  auto field = std::make_shared<reconstruct::DistanceField>(*scene.field);
  for (const auto& [key, brick] : scene.field->bricks) {
    auto seen = std::make_shared<reconstruct::FieldBrick>(*brick);
    for (std::size_t i = 0; i < reconstruct::kBrickVoxels; ++i) {
      if (seen->radiance[i].maxCoeff() < clip) continue;
      seen->radiance[i] = seen->radiance[i].cwiseMin(clip);
      seen->radiance_weight[i] = 0;
    }
    field->bricks[key] = std::move(seen);
  }
  scene.field = std::move(field);
  return scene;
}

TEST(ClippedPixels, ShadowsHaveTheDepthThatTheLightGivesThem) {
  const ClosedScene scene = bright_floor();
  const capture::FrameSet linear = scene.frame();
  relight::RayRenderer unlimited(scene.session());
  const relight::RelitPicture exact = unlimited.relight(linear, scene.scene(), scene.exhibit, rays_plan(1, 64), true);
  constexpr float kOver = 1.6f;  // times the range, at the brightest place
  const float brightest = *std::max_element(linear.color->radiance.data.begin(), linear.color->radiance.data.end());
  const float exposure = kOver / brightest;
  relight::RayRenderer clipping(scene.session());
  const relight::RelitPicture picture = clipping.relight(
      encoded(linear, exposure), with_bounds(scene.scene(), 1 / exposure), scene.exhibit, rays_plan(1, 64), true);
  int shadowed = 0;
  double squares = 0, change = 0;
  for (std::size_t i = 0; i < linear.color->radiance.data.size(); i += 3) {
    const float light = exposure * linear.color->radiance.data[i], delta = exposure * exact.maps->delta.data[i];
    if (exact.maps->mask.data[i / 3] > 0 || light < 1.02f || light + delta > 0.9f) continue;
    const double found = capture::srgb_to_linear(static_cast<float>(picture.srgb.data[i]) / 255);
    squares += std::pow(found - (light + delta), 2);
    change += std::pow(1 - (light + delta), 2);
    ++shadowed;
  }
  EXPECT_GT(shadowed, 50);
  EXPECT_LT(std::sqrt(squares / change), 0.1);
  // Beyond the shadow white stays white.
  for (std::size_t i = 0; i < linear.color->radiance.data.size(); i += 3) {
    const float light = exposure * linear.color->radiance.data[i], delta = exposure * exact.maps->delta.data[i];
    if (exact.maps->mask.data[i / 3] > 0 || light < 1.1f || light + delta < 1.05f) continue;
    EXPECT_GE(picture.srgb.data[i], 250) << i / 3;
  }
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
  relight::RayRenderer renderer(scene.session(), relight::RayRenderer::Rooms::taken);
  renderer.take(renderer.room_of(before));
  renderer.relight(encoded(scene.frame(), exposure), before, scene.exhibit, rays_plan(2), true);
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
  const auto kept = renderer.relight(frame, after, scene.exhibit, rays_plan(2), true);
  relight::RayRenderer fresh(scene.session(), relight::RayRenderer::Rooms::taken);
  fresh.take(fresh.room_of(before));
  const auto anew = fresh.relight(frame, after, scene.exhibit, rays_plan(2), true);
  std::vector<int> off;  // of shadowed pixels that clip
  for (std::size_t i = 0; i < anew.srgb.data.size(); ++i) {
    const bool shadowed = std::min(kept.srgb.data[i], anew.srgb.data[i]) < 245;
    if (frame.color->encoded.data[i] < 250 || anew.maps->mask.data[i / 3] > 0 || !shadowed) continue;
    off.push_back(std::abs(kept.srgb.data[i] - anew.srgb.data[i]));
  }
  ASSERT_GT(off.size(), 100u);
  // Next to the object some are farther off: by its indirect light, which is stored.
  std::sort(off.begin(), off.end());
  EXPECT_LE(off[off.size() / 2], 2);
}

}  // namespace
}  // namespace lumigraft::test
