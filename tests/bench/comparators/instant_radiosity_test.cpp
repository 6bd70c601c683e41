// Instant radiosity against the path-traced reference and against itself.
#include "tests/bench/comparators/instant_radiosity.h"

#include <gtest/gtest.h>

#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::comparators {
namespace {

using namespace lumigraft::test;

/// A floor and two walls with a bulb and some sky, and a ball in the corner.
std::shared_ptr<const relight::ReferenceScene> corner() {
  auto scene = std::make_shared<relight::ReferenceScene>();
  Points walls;
  add_quad(&walls, {-1, 1, 0}, {1, 1, 0}, {1, 1, 1.2f}, {-1, 1, 1.2f});
  add_quad(&walls, {-1, -1, 0}, {-1, 1, 0}, {-1, 1, 1.2f}, {-1, -1, 1.2f});
  relight::Material red = lambert(0.7f);
  red.base_color = {0.5f, 0.2f, 0.1f};
  scene->real = {square(1, 0, lambert(0.3f)), mesh_of(walls, red)};
  scene->objects = {ball(0.25f, {-0.3f, 0.3f, 0.26f}, lambert(0.6f))};
  scene->lamps = {bulb({0.6f, -0.6f, 1.1f}, 0.1f, 20)};
  scene->background.setConstant(0.05f);
  return scene;
}

relight::PosedCamera from_above() { return looking({0.9f, -1.6f, 1.3f}, {-0.3f, 0.3f, 0.2f}, 1.6f, 32, 24); }

/// RMS of the differences relative to the RMS of the change, outside the objects.
double error(const relight::ReferencePicture& picture, const relight::ReferencePicture& truth) {
  double off = 0, of = 0;
  for (std::size_t i = 0; i < truth.change.data.size(); ++i) {
    if (truth.coverage.data[i / 3] > 0 || picture.coverage.data[i / 3] > 0) continue;
    off += std::pow(picture.change.data[i] - truth.change.data[i], 2);
    of += std::pow(truth.change.data[i], 2);
  }
  return std::sqrt(off / of);
}

/// Averages 4 × 4 pixels of instant radiosity, which has one ray per pixel, for a pixel of the reference.
relight::ReferencePicture lights_of(const std::shared_ptr<const relight::ReferenceScene>& scene,
                                    const relight::PosedCamera& camera, const InstantRadiosityOptions& options) {
  constexpr int kFactor = 4;
  relight::PosedCamera fine = camera;
  capture::CameraModel& m = fine.model;
  m.width *= kFactor;
  m.height *= kFactor;
  m.fx *= kFactor;
  m.fy *= kFactor;
  m.cx = (m.cx + 0.5) * kFactor - 0.5;
  m.cy = (m.cy + 0.5) * kFactor - 0.5;
  const relight::ReferencePicture picture = instant_radiosity(scene, fine, options);
  const auto smaller = [&](const capture::Image<float>& image) {
    capture::Image<float> small(camera.model.width, camera.model.height, image.channels);
    for (std::size_t i = 0; i < image.data.size(); ++i) {
      const int channel = static_cast<int>(i) % image.channels, pixel = static_cast<int>(i) / image.channels;
      small.at(pixel % m.width / kFactor, pixel / m.width / kFactor, channel) += image.data[i] / (kFactor * kFactor);
    }
    return small;
  };
  return {smaller(picture.change), smaller(picture.object), smaller(picture.coverage)};
}

InstantRadiosityOptions many() {
  InstantRadiosityOptions options;
  options.light_paths = 2048;
  options.bounces = 2;
  options.lamp_rays = 16;
  options.sky_rays = 256;
  return options;
}

TEST(InstantRadiosity, ManyLightsComeNearTheReference) {
  const auto scene = corner();
  const relight::ReferencePicture truth = relight::DeltaPathTracer(scene).change(from_above(), samples_of(256));
  const relight::ReferencePicture lights = lights_of(scene, from_above(), many());
  EXPECT_LT(error(lights, truth), 0.45) << "speckle near the ball included";
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(mean(lights.change, c), mean(truth.change, c), 0.08 * std::abs(mean(truth.change, c))) << c;
    EXPECT_NEAR(mean(lights.object, c), mean(truth.object, c), 0.06 * mean(truth.object, c)) << c;
  }
}

// A black ball over a floor only occludes light.
TEST(InstantRadiosity, DirectChangeIsTheReferences) {
  auto scene = std::make_shared<relight::ReferenceScene>(*corner());
  scene->real.pop_back();
  scene->objects = {ball(0.25f, {-0.3f, 0.3f, 0.26f}, lambert(0))};
  const relight::ReferencePicture truth = relight::DeltaPathTracer(scene).change(from_above(), samples_of(256));
  const relight::ReferencePicture lights = lights_of(scene, from_above(), many());
  EXPECT_LT(error(lights, truth), 0.04);
}

// A white ball to the side: only the light it reflects into the lamp's shadow changes the floor.
TEST(InstantRadiosity, OneBounceOfAnObjectIsTheReferences) {
  auto scene = std::make_shared<relight::ReferenceScene>();
  scene->real = {square(1, 0, lambert(0.5f))};
  scene->objects = {ball(0.25f, {0, 0, 0.5f}, lambert(0.8f))};
  scene->lamps = {panel({0, 0, 1.5f}, 0.001f, 0.001f, 1e5f)};
  scene->lamps[0].normal = {0, 0, -1};
  const relight::PosedCamera camera = looking({0.9f, -1.6f, 1.3f}, {0, 0, 0.2f}, 1.6f, 32, 24);
  const relight::ReferencePicture truth = relight::DeltaPathTracer(scene).change(camera, samples_of(256));
  const relight::ReferencePicture lights = lights_of(scene, camera, many());
  EXPECT_LT(error(lights, truth), 0.04);
}

TEST(InstantRadiosity, WithoutObjectsNothingChanges) {
  auto scene = std::make_shared<relight::ReferenceScene>(*corner());
  scene->objects = {ball(0.25f, {-0.3f, 0.3f, 50}, lambert(0.6f))};  // far above the scene
  InstantRadiosityOptions options;
  options.light_paths = 64;
  const relight::ReferencePicture picture = instant_radiosity(scene, from_above(), options);
  double max_change = 0;
  for (const float change : picture.change.data)
    max_change = std::max(max_change, std::abs(static_cast<double>(change)));
  EXPECT_LT(max_change, 1e-3);
}

}  // namespace
}  // namespace lumigraft::comparators
