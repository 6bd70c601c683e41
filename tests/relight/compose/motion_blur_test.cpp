// Blur of moving objects, against means along their way in closed form.
#include "relight/compose/motion_blur.h"

#include <cmath>
#include <numbers>

#include "relight/gather/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using relight::ObjectLayer;

/// `radiance(x, y)` where `covers(x, y)`.
template <typename Radiance, typename Covers>
ObjectLayer drawn(int width, int height, Radiance radiance, Covers covers) {
  const capture::Image<float> empty(width, height, 1);
  ObjectLayer layer{0, 0, capture::Image<float>(width, height, 3), empty, empty};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!covers(x, y)) continue;
      layer.coverage.at(x, y) = layer.distance_m.at(x, y) = 1;
      for (int c = 0; c < 3; ++c) layer.radiance.at(x, y, c) = radiance(x, y);
    }
  }
  return layer;
}

TEST(MotionBlur, ABarThatPassesIsATrapezoid) {
  constexpr int kFrom = 20, kTo = 30, kShift_px = 6;
  const ObjectLayer bar = drawn(
      50, 3, [](int, int) { return 0.4f; }, [](int x, int) { return x >= kFrom && x < kTo; });
  capture::Image<float> shift(50, 3, 2);
  for (int x = kFrom; x < kTo; ++x) shift.at(x, 1, 0) = shift.at(x, 0, 0) = shift.at(x, 2, 0) = kShift_px;
  const ObjectLayer blurred = relight::motion_blurred(bar, shift, 50, 3);
  ASSERT_EQ(blurred.left, 0);
  float sum = 0;
  for (int x = 0; x < 50; ++x) {
    // The pixel's area is covered for a part of the exposure.
    const auto covered_until = [](float edge_px, float at_px) {
      return std::clamp((at_px - edge_px) / kShift_px + 0.5f, 0.0f, 1.0f);
    };
    const auto at_px = static_cast<float>(x) + 0.5f;
    const float expected = covered_until(kFrom, at_px) - covered_until(kTo, at_px);
    EXPECT_NEAR(blurred.coverage.at(x, 1), expected, 0.03f) << x;
    EXPECT_NEAR(blurred.radiance.at(x, 1, 0), 0.4f * blurred.coverage.at(x, 1), 1e-5f) << x;
    if (blurred.coverage.at(x, 1) > 0) {
      EXPECT_EQ(blurred.distance_m.at(x, 1), 1) << x;
    }
    sum += blurred.coverage.at(x, 1);
  }
  EXPECT_NEAR(sum, kTo - kFrom, 0.01f);
}

TEST(MotionBlur, SectorsOfATurningDiscLoseTheirContrast) {
  constexpr int kEdge = 81, kMiddle = 40, kSectors = 8;
  constexpr float kRadius_px = 36, kTurn_rad = 0.35f;
  const auto offset = [](int x, int y) {
    return Vector2f(static_cast<float>(x - kMiddle), static_cast<float>(y - kMiddle));
  };
  const auto wave = [&](int x, int y) { return std::cos(kSectors * std::atan2(offset(x, y).y(), offset(x, y).x())); };
  const auto on_disc = [&](int x, int y) { return offset(x, y).norm() < kRadius_px; };
  const ObjectLayer disc = drawn(
      kEdge, kEdge, [&](int x, int y) { return 0.5f + 0.4f * wave(x, y); }, on_disc);
  capture::Image<float> shift(kEdge, kEdge, 2);
  for (int y = 0; y < kEdge; ++y) {
    for (int x = 0; x < kEdge; ++x) {
      const Vector2f by =
          Eigen::Rotation2Df(kTurn_rad / 2) * offset(x, y) - Eigen::Rotation2Df(-kTurn_rad / 2) * offset(x, y);
      if (on_disc(x, y)) std::copy_n(by.data(), 2, &shift.at(x, y, 0));
    }
  }
  const ObjectLayer blurred = relight::motion_blurred(disc, shift, kEdge, kEdge);
  const float kept = std::sin(kSectors * kTurn_rad / 2) / (kSectors * kTurn_rad / 2);
  for (int y = 0; y < kEdge; ++y) {
    for (int x = 0; x < kEdge; ++x) {
      const float radius_px = offset(x, y).norm();
      if (radius_px < 12 || radius_px > 28) continue;
      const auto i = *blurred.index(x, y);
      EXPECT_NEAR(blurred.coverage.data[i], 1, 1e-4f);
      EXPECT_NEAR(blurred.radiance.data[3 * i], 0.5f + 0.4f * kept * wave(x, y), 0.03f) << x << ", " << y;
    }
  }
}

TEST(MotionBlur, NothingChangesAtRest) {
  const ObjectLayer bar = drawn(
      20, 3, [](int, int) { return 0.4f; }, [](int x, int) { return x >= 5 && x < 9; });
  EXPECT_EQ(relight::motion_blurred(bar, capture::Image<float>(20, 3, 2), 20, 3).coverage.data, bar.coverage.data);
}

/// A box that passes before the camera at 1 m/s.
class PassingBox : public testing::Test {
 protected:
  PassingBox() : scene_(box_on_floor()) {
    relight::VirtualObject& box = scene_.exhibit.objects[0];
    for (const double time_s : {-1.0, 1.0})
      box.motion.push_back({time_s, box.position_m + time_s * Eigen::Vector3d::UnitX(), box.rotation});
  }
  relight::RelitPicture picture(std::optional<double> exposure_us, const std::string& look) const {
    capture::Session session = scene_.session();
    session.color.settings.exposure_us = exposure_us;
    relight::Plan plan = rays_plan(8, 4);
    plan.look = look;
    capture::FrameSet frame = scene_.frame();
    frame.time_ns = 0;
    return relight::RayRenderer(session).relight(frame, scene_.scene(), scene_.exhibit, plan, true);
  }

  ClosedScene scene_;
};

TEST_F(PassingBox, MovesByItsSpeedTimesTheExposure) {
  constexpr double kExposure_s = 0.04;
  const auto motions = relight::motions_over(scene_.exhibit, 0, kExposure_s);
  ASSERT_EQ(motions.size(), 1u);
  EXPECT_TRUE(motions[0].any);
  relight::PosedCamera camera{scene_.session().color.model};
  camera.T_tag_camera.translation() = Vector3f(0, 0, -0.8f);
  const auto shift = motions[0].shift_px(camera, Vector3f(0.02f, 0.1f, 0));
  ASSERT_TRUE(shift);
  EXPECT_NEAR(shift->x(), scene_.focal_px * 1 * kExposure_s / 0.8, 1e-3);
  EXPECT_NEAR(shift->y(), 0, 1e-4);
  EXPECT_FALSE(relight::motions_over(scene_.exhibit, 5, kExposure_s)[0].any) << "it has arrived";
}

TEST_F(PassingBox, IsBlurredAlongItsWay) {
  const relight::RelitPicture sharp = picture(std::nullopt, "camera"), blurred = picture(40'000, "camera"),
                              again = picture(40'000, "camera"), plain = picture(40'000, "plain");
  EXPECT_EQ(blurred.srgb.data, again.srgb.data);
  EXPECT_EQ(plain.maps->mask.data, sharp.maps->mask.data);
  const auto sums = [](const capture::Image<float>& mask) {
    float all = 0, mixed = 0;
    for (const float covered : mask.data) {
      all += covered;
      mixed += covered > 0.02f && covered < 0.98f ? 1.0f : 0.0f;
    }
    return std::pair{all, mixed};
  };
  const auto [all, mixed] = sums(sharp.maps->mask);
  const auto [all_now, mixed_now] = sums(blurred.maps->mask);
  EXPECT_NEAR(all_now, all, 0.02f * all) << "it covers as much as at rest";
  EXPECT_GT(mixed_now, 2 * mixed);
}

}  // namespace
}  // namespace lumigraft::test
