#include "reconstruct/exposure/camera_match.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

/// A smooth room around the fish-eye at the origin, seen over the whole sphere.
Illumination room() {
  Illumination light;
  light.environment.radiance = capture::Image<float>(128, 64, 3);
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 128; ++u) {
      const double phi = 2 * std::numbers::pi * (u + 0.5) / 128, theta = std::numbers::pi * (v + 0.5) / 64;
      for (int c = 0; c < 3; ++c)
        light.environment.radiance.at(u, v, c) = static_cast<float>(1 + 0.3 * std::sin(2 * phi + c) * std::sin(theta));
    }
  }
  return light;
}

struct Seen {
  std::vector<ColorPlace> places;
  std::vector<Vector3f> surface_m;
};

/// A wall 2 m before the fish-eye, whose picture has `gain`, and exp(-falloff x) of the light at the distance x.
Seen wall(const Illumination& light, const Array3f& gain, float falloff) {
  Seen seen;
  for (float y = -1; y <= 1; y += 0.1f) {
    for (float z = -0.7f; z <= 0.7f; z += 0.1f) {
      const Vector3f position_m(2, y, z);
      const float corner = (y * y + z * z) / 1.5f;
      const Array3f radiance = light.environment.sample(position_m.normalized());
      seen.places.push_back({position_m, -Vector3f::UnitX(), radiance * gain * std::exp(-falloff * corner), corner});
      seen.surface_m.push_back(position_m);
    }
  }
  return seen;
}

TEST(CameraMatch, FindsWhiteBalanceLevelAndVignetting) {
  const Illumination light = room();
  const Array3f gain(0.62f, 1.0f, 1.45f);
  for (const float falloff : {0.0f, 0.7f}) {
    const Seen seen = wall(light, gain, falloff);
    const auto match = match_cameras(seen.places, seen.surface_m, light, true);
    ASSERT_TRUE(match);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(match->log_gain[c], std::log(gain[c]), 0.02) << c;
    EXPECT_NEAR(match->falloff.sum(), falloff, 0.05);
    EXPECT_LT(match->hue_sigma, match->level_sigma) << "vignetting and level are similar, hue is neither";
  }
}

TEST(CameraMatch, DoesNotInventVignettingWhereNoneIsAsked) {
  const Illumination light = room();
  const Seen seen = wall(light, Array3f::Ones(), 0.2f);
  const auto match = match_cameras(seen.places, seen.surface_m, light, false);
  ASSERT_TRUE(match);
  EXPECT_TRUE(match->falloff.isZero(0));
}

TEST(CameraMatch, WhatIsHiddenFromTheFisheyeSaysNothing) {
  const Illumination light = room();
  Seen seen = wall(light, Array3f::Ones(), 0);
  // A board before most of the wall, of which the fish-eye sees the back: the wall behind it is eight times as bright.
  for (float y = -0.5f; y <= 0.15f; y += 0.02f)
    for (float z = -0.4f; z <= 0.4f; z += 0.02f) seen.surface_m.emplace_back(1, y, z);
  for (ColorPlace& place : seen.places)
    if (place.position_m.y() < 0.3f) place.radiance *= 8;
  const auto match = match_cameras(seen.places, seen.surface_m, light, true);
  ASSERT_TRUE(match);
  EXPECT_NEAR(match->log_gain.mean(), 0, 0.03);
}

TEST(CameraMatch, TheOtherSideOfABoardSaysNothing) {
  const Illumination light = room();
  Seen seen = wall(light, Array3f::Ones(), 0);
  for (ColorPlace& place : seen.places) {
    if (place.position_m.y() > 0.3f) continue;
    place.normal = Vector3f::UnitX();
    place.radiance *= Array3f(0.5f, 1, 3);  // another lamp lights it
  }
  const auto match = match_cameras(seen.places, seen.surface_m, light, true);
  ASSERT_TRUE(match);
  EXPECT_LT(match->log_gain.abs().maxCoeff(), 0.03f);
}

TEST(CameraMatch, TwoFifthsOfOutliersAreIgnored) {
  const Illumination light = room();
  Seen seen = wall(light, Array3f::Ones(), 0);
  for (std::size_t i = 0; i < seen.places.size(); ++i)
    if (i % 5 < 2) seen.places[i].radiance *= 2;
  const auto match = match_cameras(seen.places, seen.surface_m, light, true);
  ASSERT_TRUE(match);
  EXPECT_NEAR(match->log_gain.mean(), 0, 0.03);
}

TEST(CameraMatch, IsUnknownWhereTheCamerasDisagreeOrShareTooLittle) {
  const Illumination light = room();
  Seen seen = wall(light, Array3f::Ones(), 0);
  Seen few = seen;
  few.places.resize(20);
  EXPECT_FALSE(match_cameras(few.places, few.surface_m, light, true));
  for (std::size_t i = 0; i < seen.places.size(); ++i) seen.places[i].radiance *= std::exp2(static_cast<float>(i % 7));
  EXPECT_FALSE(match_cameras(seen.places, seen.surface_m, light, true));
  EXPECT_FALSE(match_cameras(few.places, few.surface_m, Illumination(), true)) << "no environment";
}

}  // namespace
}  // namespace lumigraft::reconstruct
