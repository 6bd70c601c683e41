#include "tests/bench/comparators/composition.h"

#include <gtest/gtest.h>

#include <cmath>

#include "capture/camera/srgb.h"
#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::comparators {
namespace {

using namespace lumigraft::test;

TEST(Composition, NoDifferenceLeavesEveryCode) {
  capture::Image<std::uint8_t> camera(16, 16, 3);
  for (std::size_t i = 0; i < camera.data.size(); ++i) camera.data[i] = static_cast<std::uint8_t>(i % 256);
  const capture::Image<float> light(16, 16, 3, 0.37f), coverage(16, 16, 1);
  EXPECT_EQ(composed(camera, difference(light, light, coverage), coverage, 2).data, camera.data);
}

TEST(Composition, ObjectsReplaceTheRoomAndChangesAddUpInLinearLight) {
  const capture::Image<std::uint8_t> camera(3, 1, 3, 128);
  const capture::Image<float> with(3, 1, 3, 0.20f), without(3, 1, 3, 0.25f);
  capture::Image<float> coverage(3, 1, 1);
  coverage.at(1, 0) = 1;
  coverage.at(2, 0) = 0.5f;
  const capture::Image<std::uint8_t> picture = composed(camera, difference(with, without, coverage), coverage, 2);
  const float before = capture::srgb_to_linear(128.0f / 255);
  const auto code = [](float linear) { return static_cast<int>(std::lround(255 * capture::linear_to_srgb(linear))); };
  EXPECT_EQ(picture.at(0, 0), code(before + 2 * (0.20f - 0.25f)));
  EXPECT_EQ(picture.at(1, 0), code(2 * 0.20f));
  EXPECT_EQ(picture.at(2, 0), code(0.5f * before + 2 * (0.20f - 0.5f * 0.25f)));
}

TEST(Composition, CoverageOfADiscIsItsArea) {
  auto scene = std::make_shared<relight::ReferenceScene>();
  scene->real = {square(1, 0, lambert(0.5f))};
  scene->objects = {disc(0.3f, 0.1f, lambert(0.5f))};
  const relight::PosedCamera camera = looking({0.001f, 0, 1.1f}, {0, 0, 0.1f}, 1, 40, 40);
  const capture::Image<float> coverage = object_coverage(relight::TraceWorld(scene), camera);
  EXPECT_NEAR(mean(coverage), relight::kPi * 0.3f * 0.3f, 0.003);
}

}  // namespace
}  // namespace lumigraft::comparators
