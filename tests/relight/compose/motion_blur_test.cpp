// Blur of moving objects, against means along their way in closed form.
#include "relight/compose/motion_blur.h"

#include <cmath>
#include <numbers>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
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
  float sum = 0;
  for (int x = 0; x < 50; ++x) {
    // The pixel's area is covered for a part of the exposure.
    const auto covered_until = [](float edge_px, float at_px) {
      return std::clamp((at_px - edge_px) / kShift_px + 0.5f, 0.0f, 1.0f);
    };
    const auto i = blurred.index(x, 1);
    const float coverage = i ? blurred.coverage.data[*i] : 0, at_px = static_cast<float>(x) + 0.5f;
    const float expected = covered_until(kFrom, at_px) - covered_until(kTo, at_px);
    EXPECT_NEAR(coverage, expected, 0.03f) << x;
    if (!i) continue;
    EXPECT_NEAR(blurred.radiance.data[3 * *i], 0.4f * coverage, 1e-5f) << x;
    if (coverage > 0) {
      EXPECT_EQ(blurred.distance_m.data[*i], 1) << x;
    }
    sum += coverage;
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

/// A box that passes before the camera at 1 m/s, to the right.
class PassingBox {
 public:
  PassingBox() : scene_(box_on_floor()) {
    relight::VirtualObject& box = scene_.exhibit.objects[0];
    for (const double time_s : {-1.0, 1.0})
      box.motion.push_back({time_s, box.position_m + time_s * Eigen::Vector3d::UnitX(), box.rotation});
  }
  /// A second box that rests beside it.
  void add_neighbour() {
    scene_.exhibit.objects.push_back(box_object({0.12f, -0.05f, 0.01f}, {0.32f, 0.05f, 0.2f}, 0.9f));
  }
  capture::Session session(std::optional<double> exposure_us) const {
    capture::Session session = scene_.session();
    session.color.settings.exposure_us = exposure_us;
    return session;
  }
  relight::RelitPicture picture(relight::Renderer& renderer, relight::Plan plan, const std::string& look) const {
    plan.look = look;
    capture::FrameSet frame = scene_.frame();
    frame.time_ns = 0;
    return renderer.relight(frame, scene_.scene(), scene_.exhibit, plan, true);
  }

  /// `make(session)` creates a renderer.
  template <typename Make>
  void is_blurred_along_its_way(const Make& make, const relight::Plan& plan) const {
    const auto of = [&](std::optional<double> exposure_us, const char* look) {
      return picture(*make(session(exposure_us)), plan, look);
    };
    const relight::RelitPicture sharp = of(std::nullopt, "camera"), blurred = of(kExposure_s * 1e6, "camera"),
                                again = of(kExposure_s * 1e6, "camera"), plain = of(kExposure_s * 1e6, "plain");
    EXPECT_EQ(blurred.srgb.data, again.srgb.data);
    EXPECT_EQ(plain.srgb.data, sharp.srgb.data) << "no noise or blur was measured";
    // In the rows of the box's front the light next to its left edge, which the box covers for a part of the exposure:
    // linear over the way, from the floor's to the box's.
    const int row = row_of_front();
    const auto light = [&](const relight::RelitPicture& of_picture, int u) {
      double sum = 0;
      for (int v = row - 2; v <= row + 2; ++v) sum += static_cast<double>(picture_radiance(of_picture, u, v)) / 5;
      return sum;
    };
    int edge = 0;
    while (sharp.maps->mask.at(edge, row) < 0.5f) ++edge;
    const double way_px = scene_.focal_px * kExposure_s / static_cast<double>(depth_of_front_m());
    ASSERT_GT(way_px, 5);
    for (int off = -6; off <= 6; ++off) {
      const double covered = std::clamp(0.5 + (off + 0.5) / way_px, 0.0, 1.0);
      const double expected = (1 - covered) * light(sharp, std::min(edge + off, edge - 2)) +
                              covered * light(sharp, std::max(edge + off, edge + 1));
      EXPECT_NEAR(light(blurred, edge + off), expected, 0.02) << plan.method << ", " << off << " px from the edge";
    }
  }

  /// What moves is blurred, and what rests beside it is not, though their bounding spheres overlap.
  template <typename Make>
  void leaves_what_rests(const Make& make, const relight::Plan& plan) const {
    const relight::RelitPicture sharp = picture(*make(session(std::nullopt)), plan, "camera"),
                                blurred = picture(*make(session(kExposure_s * 1e6)), plan, "camera");
    const int row = row_of_front();
    int last = scene_.width - 1;
    while (sharp.maps->mask.at(last, row) < 0.5f) --last;
    for (int v = row - 2; v <= row + 2; ++v) {
      for (int u = last - 4; u <= last + 4; ++u)
        EXPECT_NEAR(blurred.srgb.at(u, v, 0), sharp.srgb.at(u, v, 0), 2) << plan.method << ", " << u << ", " << v;
    }
    double change = 0;
    for (std::size_t i = 0; i < sharp.srgb.data.size(); ++i)
      change = std::max(change, std::abs(double{1} * sharp.srgb.data[i] - blurred.srgb.data[i]));
    EXPECT_GT(change, 20) << plan.method << ": the other is";
  }

  ClosedScene scene_;

 private:
  static constexpr double kExposure_s = 0.06;
  static constexpr float kFront_y = -0.05f, kMiddle_z = 0.1f;
  float depth_of_front_m() const {
    return (scene_.T_tag_camera().inverse().cast<float>() * Vector3f(-0.1f, kFront_y, kMiddle_z)).z();
  }
  int row_of_front() const {
    const auto pixel =
        scene_.session().color.model.project(scene_.T_tag_camera().inverse() * Eigen::Vector3d(0, kFront_y, kMiddle_z));
    return static_cast<int>(std::lround(pixel->y()));
  }
};

TEST(PassingBoxMotion, MovesByItsSpeedTimesTheExposure) {
  const PassingBox passing;
  constexpr double kExposure_s = 0.04;
  const auto motions = relight::motions_over(passing.scene_.exhibit, 0, kExposure_s);
  ASSERT_EQ(motions.size(), 1u);
  EXPECT_TRUE(motions[0].any);
  relight::PosedCamera camera{passing.scene_.session().color.model};
  camera.T_tag_camera.translation() = Vector3f(0, 0, -0.8f);
  const auto shift = motions[0].shift_px(camera, Vector3f(0.02f, 0.1f, 0));
  ASSERT_TRUE(shift);
  EXPECT_NEAR(shift->x(), passing.scene_.focal_px * 1 * kExposure_s / 0.8, 1e-3);
  EXPECT_NEAR(shift->y(), 0, 1e-4);
  EXPECT_FALSE(relight::motions_over(passing.scene_.exhibit, 5, kExposure_s)[0].any) << "it has arrived";
}

/// Both checks by one method.
template <typename Make>
void check_passing(const Make& make, const relight::Plan& plan) {
  PassingBox passing;
  passing.is_blurred_along_its_way(make, plan);
  passing.add_neighbour();
  passing.leaves_what_rests(make, plan);
}

TEST(PassingBoxBy, Rays) {
  check_passing([](const capture::Session& session) { return std::make_unique<relight::RayRenderer>(session); },
                rays_plan(8, 8));
}

TEST(PassingBoxBy, Reference) {
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = 16;
  check_passing([](const capture::Session& session) { return std::make_unique<relight::ReferenceRenderer>(session); },
                plan);
}

class PassingBoxByDevices : public ClosedTest {
 protected:
  void check(const relight::Plan& plan) const {
    check_passing(
        [&](const capture::Session& session) { return std::make_unique<relight::Relighter>(device_, session); }, plan);
  }
};
// The blur is computed on the processor.
INSTANTIATE_TEST_SUITE_P(On, PassingBoxByDevices, testing::Values(relight::gpu::Backend::vulkan));

TEST_P(PassingBoxByDevices, Live) { check(live_plan()); }
TEST_P(PassingBoxByDevices, Full) { check(coarse_plan()); }
TEST_P(PassingBoxByDevices, Propagated) {
  relight::Plan plan = live_plan();
  plan.method = "dlpv";
  check(plan);
}

}  // namespace
}  // namespace lumigraft::test
