#include "reconstruct/light/split.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "reconstruct/light/environment.h"
#include "reconstruct/light/lamp_regions.h"
#include "tests/reconstruct/light/light_views.h"

namespace lumigraft::reconstruct {
namespace {

/// Clips an image at `max`; returns the mask of clipped pixels.
capture::Image<std::uint8_t> clip(capture::Image<float>* picture, float max) {
  capture::Image<std::uint8_t> clipped = unclipped(*picture);
  for (std::size_t i = 0; i < clipped.data.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = picture->data[3 * i + c];
      if (value < max) continue;
      value = max;
      clipped.data[i] = 1;
    }
  }
  return clipped;
}

Eigen::Vector3d integral(const capture::Image<float>& picture, const FisheyeView& view) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t pixel = 0; pixel < view.solid_angle_sr.size(); ++pixel) {
    for (int c = 0; c < 3; ++c) sum[c] += double(picture.data[3 * pixel + c]) * view.solid_angle_sr[pixel];
  }
  return sum;
}

const Eigen::Vector3f kRoom(0.1f, 0.12f, 0.15f);

TEST(LightSplit, OneLampInClosedForm) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  for (const double polar : {5.0, 40.0, 80.0}) {
    const Eigen::Vector3f lamp = towards(polar, 70), radiance(40, 30, 20);
    const auto picture =
        render(camera, [&](const Eigen::Vector3f& d) { return within(d, lamp, 3) ? radiance : kRoom; });
    const LightSplit split = split_lamps(picture, unclipped(picture), view, 8);
    ASSERT_EQ(split.lamps.size(), 1u) << polar;
    EXPECT_LT(angle_degrees(split.lamps[0].direction, lamp), 0.05);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(split.lamps[0].irradiance[c] / ((radiance[c] - kRoom[c]) * disk_sr(3)), 1, 0.01);
    }
    EXPECT_NEAR(split.lamps[0].solid_angle_sr / disk_sr(3), 1, 0.08);
    // The residual there is the background.
    for (std::size_t i = 0; i < view.solid_angle_sr.size(); ++i) {
      if (within(view.direction[i], lamp, 4)) {
        EXPECT_NEAR(split.residual.data[3 * i], kRoom[0], 1e-4);
      }
    }
  }
}

// A tube's shadows are soft along it and sharp across it.
TEST(LightSplit, OutlineOfATube) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  const Eigen::Vector3f lamp = towards(40, 70), along = lamp.unitOrthogonal(), across = lamp.cross(along);
  const float half_length = 0.12f, half_width = 0.03f;
  const auto picture = render(camera, [&](const Eigen::Vector3f& d) {
    const float ahead = d.dot(lamp), x = d.dot(along) / ahead, y = d.dot(across) / ahead;
    const bool inside = ahead > 0 && std::abs(x) < half_length && std::abs(y) < half_width;
    return inside ? Eigen::Vector3f(40, 30, 20) : kRoom;
  });
  const LightSplit split = split_lamps(picture, unclipped(picture), view, 8);
  ASSERT_EQ(split.lamps.size(), 1u);
  const SplitLamp& found = split.lamps[0];
  EXPECT_NEAR(std::numbers::pi_v<float> * found.outline_u.cross(found.outline_v).norm() / found.solid_angle_sr, 1,
              1e-4);
  EXPECT_NEAR(found.outline_u.dot(found.direction), 0, 1e-5);
  // Of an ellipse with the moments of a rectangle.
  const auto reach = [&](const Eigen::Vector3f& axis) {
    return std::hypot(found.outline_u.dot(axis), found.outline_v.dot(axis));
  };
  EXPECT_NEAR(reach(along) / reach(across), half_length / half_width, 0.08f * half_length / half_width);
  EXPECT_NEAR(reach(along), 2 / std::sqrt(3.0f) * half_length, 0.05f * half_length);
}

TEST(LightSplit, ABlackImageHasNoLamp) {
  const capture::FisheyeCamera camera = fisheye();
  const auto picture = render(camera, [](const Eigen::Vector3f&) { return Eigen::Vector3f(0, 0, 0); });
  const LightSplit split = split_lamps(picture, unclipped(picture), fisheye_view(camera), 8);
  EXPECT_TRUE(split.lamps.empty());
  EXPECT_EQ(split.residual.data, picture.data);
}

TEST(LightSplit, LampsAndResidualIntegrateToTheImage) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  const Eigen::Vector3f bulb = towards(50, 10), panel = towards(30, 200), tiny = towards(70, 100);
  const auto picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
    if (within(d, bulb, 3)) return {85, 55, 28};
    if (within(d, panel, 9)) return {9, 13, 19};
    if (within(d, tiny, 0.4)) return {3, 3, 3};  // under 1 % of the energy: stays in the residual
    return kRoom * (1.2f + d.z() + 0.5f * d.x());
  });
  const LightSplit split = split_lamps(picture, unclipped(picture), view, 8);
  ASSERT_EQ(split.lamps.size(), 2u);
  Eigen::Vector3d sum = integral(split.residual, view);
  for (const SplitLamp& lamp : split.lamps) sum += lamp.irradiance.cast<double>();
  const Eigen::Vector3d total = integral(picture, view);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c] / total[c], 1, 1e-6);
}

TEST(LightSplit, TwoLampsTwoToFortyDegreesApart) {
  const capture::FisheyeCamera camera = fisheye(160, 430);
  const FisheyeView view = fisheye_view(camera);
  for (const double separation : {2.0, 5.0, 12.0, 40.0}) {
    const Eigen::Vector3f a = towards(30, 0), b = towards(30 + separation, 0);
    const double radius = std::min(2.0, 0.3 * separation);
    const auto picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
      return within(d, a, radius)   ? Eigen::Vector3f(30, 30, 30)
             : within(d, b, radius) ? Eigen::Vector3f(10, 15, 20)
                                    : kRoom;
    });
    const LightSplit split = split_lamps(picture, unclipped(picture), view, 8);
    ASSERT_EQ(split.lamps.size(), 2u) << separation;
    // Two degrees are 5 pixels here: the stronger lamp takes the blurred border; the total energy is kept.
    const bool touching = separation < 3;
    EXPECT_LT(angle_degrees(split.lamps[0].direction, a), touching ? 0.2 : 0.05) << separation;
    EXPECT_LT(angle_degrees(split.lamps[1].direction, b), touching ? 0.2 : 0.05) << separation;
    const double first = split.lamps[0].irradiance.y() / disk_sr(radius),
                 second = split.lamps[1].irradiance.y() / disk_sr(radius);
    EXPECT_NEAR((first + second) / 45, 1, 0.03) << separation;
    EXPECT_NEAR(first / 30, 1, touching ? 0.15 : 0.03) << separation;
    EXPECT_NEAR(second / 15, 1, touching ? 0.3 : 0.03) << separation;
  }
}

TEST(LightSplit, AWindowBecomesSeveralLamps) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  const Eigen::Vector3f window = towards(45, 120);
  const double radius = 22;
  const auto picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
    return within(d, window, radius) ? Eigen::Vector3f(5, 6, 8) : kRoom;
  });
  const LightSplit split = split_lamps(picture, unclipped(picture), view, 8);
  EXPECT_GE(split.lamps.size(), 2u);
  EXPECT_LE(split.lamps.size(), 8u);
  Eigen::Vector3f sum = Eigen::Vector3f::Zero(), centre = Eigen::Vector3f::Zero();
  for (const SplitLamp& lamp : split.lamps) {
    sum += lamp.irradiance;
    centre += lamp.irradiance.y() * lamp.direction;
    EXPECT_EQ(lamp.region, split.lamps.front().region);
  }
  EXPECT_GE(split.lamps.front().region, 0);
  EXPECT_NEAR(sum.y() / ((6 - kRoom.y()) * disk_sr(radius)), 1, 0.01);
  EXPECT_LT(angle_degrees(centre, window), 0.1);
}

// Parts of one region are placed together.
TEST(LightSplit, PiecesOfOneWindowShareARegionThoseOfTwoDoNot) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  for (const bool two : {false, true}) {
    const auto picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
      const float z = d.z(), y = d.y() / std::max(-d.x(), 1e-3f);
      const bool wide = d.x() < 0 && std::abs(y) < 0.9f && z > 0.05f && z < 0.65f;
      const bool mullion = two && std::abs(y) < 0.25f;
      return wide && !mullion ? Eigen::Vector3f(2.0f, 2.6f, 3.4f) : 0.2f * kRoom;
    });
    const LightSplit split = split_lamps(picture, unclipped(picture), view, 8);
    ASSERT_GE(split.lamps.size(), 3u);
    std::vector<int> regions;
    for (const SplitLamp& lamp : split.lamps) regions.push_back(lamp.region);
    const bool same = std::all_of(regions.begin(), regions.end(), [&](int r) { return r >= 0 && r == regions[0]; });
    EXPECT_EQ(same, !two);
  }
}

TEST(LightSplit, SoftGlowAndLitPaperAreNoLamps) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  const Eigen::Vector3f lamp = towards(20, 0), glow = towards(70, 90), paper = towards(80, 200);
  const auto picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
    if (within(d, lamp, 3)) return {50, 50, 50};
    if (within(d, paper, 6)) return Eigen::Vector3f::Constant(0.12f);
    const float x = angle_degrees(d, glow) / 12;
    return Eigen::Vector3f::Constant(0.02f + 1.5f * std::exp(-x * x));
  });
  const LightSplit split = split_lamps(picture, unclipped(picture), view, 8);
  ASSERT_EQ(split.lamps.size(), 1u);
  EXPECT_LT(angle_degrees(split.lamps[0].direction, lamp), 0.05);
}

TEST(LightSplit, ClippedLampIsFoundAndAClippedWallIsNot) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  const Eigen::Vector3f lamp = towards(40, 0), wall = towards(70, 180);
  auto picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
    const float x = angle_degrees(d, wall) / 15;
    return within(d, lamp, 3) ? Eigen::Vector3f(50, 50, 50)
                              : Eigen::Vector3f::Constant(0.08f + 0.12f * std::exp(-x * x));
  });
  const capture::Image<std::uint8_t> clipped = clip(&picture, 0.16f);
  const LightSplit split = split_lamps(picture, clipped, view, 8);
  ASSERT_EQ(split.lamps.size(), 1u);
  EXPECT_TRUE(split.lamps[0].clipped);
  EXPECT_LT(angle_degrees(split.lamps[0].direction, lamp), 0.1);
}

// A strip of warm wall between two door frames, lit just enough to clip in one channel: the edges are sharp on most of
// its outline.
TEST(LightSplit, WallThatClipsInOneChannelIsNoLamp) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  for (const bool lamp : {false, true}) {
    capture::Image<float> picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
      const double across = std::atan2(d.y(), d.x()) / kDegree, above = std::asin(d.z()) / kDegree - 25;
      if (std::abs(across) > 2 || d.x() < 0) return Eigen::Vector3f::Constant(0.3f);
      const double fades = std::exp(-above * above / 144);
      return (lamp && std::abs(above) < 5 ? 40 : 1.2 * fades) * Eigen::Vector3f(1, 0.9f, 0.75f);
    });
    const capture::Image<std::uint8_t> clipped = clip(&picture, 1);
    EXPECT_EQ(split_lamps(picture, clipped, view, 8).lamps.size(), lamp ? 1u : 0u);
  }
}

// A blue bulb close to a wall: around it the wall clips too, in one channel, and farther off in none.
TEST(LightSplit, ClippedLampInFrontOfAClippedWallIsFound) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  const Eigen::Vector3f lamp = towards(60, 20), radiance(7, 16, 42);
  capture::Image<float> picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
    const float away = std::acos(std::min(d.dot(lamp), 1.0f)) / 0.35f;  // 20°
    return within(d, lamp, 1.8) ? radiance : kRoom + Eigen::Vector3f(0.25f, 0.6f, 2.5f) / (1 + away * away);
  });
  const capture::Image<std::uint8_t> clipped = clip(&picture, 1);
  const LightSplit split = split_lamps(picture, clipped, view, 8);
  ASSERT_EQ(split.lamps.size(), 1u);
  EXPECT_TRUE(split.lamps[0].clipped);
  EXPECT_LT(angle_degrees(split.lamps[0].direction, lamp), 0.1);
  EXPECT_NEAR(split.lamps[0].solid_angle_sr / disk_sr(1.8), 1, 0.4);  // pixels that it covers in part clip too
}

// The sun is little wider than a pixel. In a sky that nearly clips it is not found.
TEST(LightSplit, ClippedSunOfAFewPixelsIsFound) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  for (const double polar : {20.0, 48.5, 71.3}) {
    const Eigen::Vector3f sun = towards(polar, 130);
    for (const float sky : {0.4f, 0.9f}) {
      capture::Image<float> picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
        if (within(d, sun, 0.27)) return Eigen::Vector3f::Constant(3e4f);
        return sky * Eigen::Vector3f(0.8f, 0.9f, 1.05f);
      });
      const capture::Image<std::uint8_t> clipped = clip(&picture, 1);
      const LightSplit split = split_lamps(picture, clipped, view, 8);
      ASSERT_EQ(split.lamps.size(), sky < 0.5f ? 1u : 0u) << polar;
      if (split.lamps.empty()) continue;
      EXPECT_TRUE(split.lamps[0].clipped);
      EXPECT_LT(angle_degrees(split.lamps[0].direction, sun), 0.3);
    }
  }
}

// Polished stone below a lamp: its bright grains clip, its dark ones do not.
TEST(LightSplit, ClippedStoneFloorIsNoLamp) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  const Eigen::Vector3f lamp = towards(40, 0), floor = towards(70, 180);
  auto picture = render(camera, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
    if (within(d, lamp, 3)) return {50, 50, 50};
    if (!within(d, floor, 14)) return Eigen::Vector3f::Constant(0.08f);
    const auto grain = [](float x) { return static_cast<unsigned>(std::floor(x * 40) + 100); };
    const unsigned hash =
        (grain(d.x()) * 73856093u ^ grain(d.y()) * 19349663u ^ grain(d.z()) * 83492791u) * 2654435761u;
    return Eigen::Vector3f::Constant(hash >> 16 & 3 ? 0.3f : 0.08f);
  });
  const capture::Image<std::uint8_t> clipped = clip(&picture, 0.16f);
  const LightSplit split = split_lamps(picture, clipped, view, 8);
  ASSERT_EQ(split.lamps.size(), 1u);
  EXPECT_LT(angle_degrees(split.lamps[0].direction, lamp), 0.1);
}

TEST(LightSplit, NoLampInASmoothSky) {
  const capture::FisheyeCamera camera = fisheye();
  const FisheyeView view = fisheye_view(camera);
  const auto picture = render(camera, [&](const Eigen::Vector3f& d) { return (kRoom * (1 + d.z())).eval(); });
  const LightSplit split = split_lamps(picture, unclipped(picture), view, 8);
  EXPECT_TRUE(split.lamps.empty());
  EXPECT_EQ(split.residual.data, picture.data);
}

TEST(LightSplit, VarianceCutHalvesAStripInTheMiddle) {
  const FisheyeView view = fisheye_view(fisheye());
  std::vector<PixelEnergy> strip;
  for (std::uint32_t x = 100; x < 200; ++x) {
    for (std::uint32_t y = 150; y < 154; ++y) strip.push_back({y * 300 + x, Eigen::Vector3f::Constant(1)});
  }
  const auto parts = variance_cut(strip, view, 2);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_NEAR(static_cast<double>(parts[0].size()), 200, 8);
  EXPECT_EQ(parts[0].size() + parts[1].size(), strip.size());
}

TEST(LightEnvironment, ResampledPictureKeepsEnergyAndDirections) {
  const capture::FisheyeCamera camera = fisheye(359.9);  // covers almost the whole sphere, so nothing is filled
  const FisheyeView view = fisheye_view(camera);
  const Radiance radiance = [](const Eigen::Vector3f& d) {
    return Eigen::Vector3f(1 + d.x(), 1 + 0.5f * d.y(), 1 - 0.8f * d.z());
  };
  const auto picture = render(camera, radiance);
  const EnvironmentMap environment = EnvironmentResampler(camera, view, 128, 64).resample(picture, view);
  const Eigen::Vector3d total = integral(picture, view);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 128; ++u) {
      const Eigen::Vector3f d = environment_direction(u, v, 128, 64);
      for (int c = 0; c < 3; ++c) sum[c] += environment.radiance.at(u, v, c) * environment_solid_angle_sr(v, 128, 64);
      EXPECT_LT((environment.sample(d) - radiance(d)).norm(), v < 2 || v > 61 ? 0.25 : 0.03) << u << " " << v;
    }
  }
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c] / total[c], 1, 1e-3);
  // 1 + x has the coefficients 2√π and √(4π/3).
  const Sh9 sh = project_sh(environment);
  EXPECT_NEAR(sh[0].x(), std::sqrt(4 * std::numbers::pi), 0.02);
  EXPECT_NEAR(sh[3].x(), std::sqrt(4 * std::numbers::pi / 3), 0.02);
  EXPECT_NEAR(sh[2].z(), -0.8 * std::sqrt(4 * std::numbers::pi / 3), 0.02);
  EXPECT_NEAR(sh[8].y(), 0, 0.01);
}

TEST(LightEnvironment, UnseenDirectionsTakeTheNearestSeen) {
  const capture::FisheyeCamera camera = fisheye(190);
  const FisheyeView view = fisheye_view(camera);
  const auto picture = render(
      camera, [](const Eigen::Vector3f& d) { return d.x() > 0 ? Eigen::Vector3f(2, 2, 2) : Eigen::Vector3f(1, 1, 1); });
  const EnvironmentMap environment = EnvironmentResampler(camera, view, 128, 64).resample(picture, view);
  EXPECT_NEAR(environment.sample(towards(120, 0)).x(), 2, 0.05);
  EXPECT_NEAR(environment.sample(towards(120, 180)).x(), 1, 0.05);
  EXPECT_NEAR(environment.sample(towards(30, 180)).x(), 1, 0.05);
}

}  // namespace
}  // namespace lumigraft::reconstruct
