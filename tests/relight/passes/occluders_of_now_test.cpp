// What hides lamps now and not when the room was fused, by the methods on a device and by `reference`: shadows that the
// camera sees, and surface that it sees through.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using relight::RelitPicture;

/// A white box on a floor under a lamp.
class OccludersOfNow : public ClosedTest {
 protected:
  OccludersOfNow() : scene_(box_on_floor()) {
    scene_.extent.extend(Eigen::Vector3f(0.9f, 1.6f, 0));
    scene_.sky = 0.01f;  // the box's shadow is that of the lamp
    depth_m_ = scene_.frame().depth->depth_m;
  }

  /// Light is looked up in one, and computed per pixel in the other, which one device is enough for: it takes longer.
  static std::vector<relight::Plan> plans() {
    if (GetParam() != relight::gpu::Backend::vulkan) return {live_plan()};
    std::vector<relight::Plan> plans{live_plan(), coarse_plan()};
    return plans;
  }
  RelitPicture relit(relight::Renderer& renderer, const reconstruct::Scene& room, const relight::Plan& plan) const {
    return renderer.relight(scene_.frame(), room, scene_.exhibit, plan, true);
  }
  /// Radiance of the lamp's light that leaves the box's top.
  float of_lamp(const Eigen::Vector3f& at_m) const {
    return 0.9f / std::numbers::pi_v<float> * irradiance(scene_.lamps[0], at_m, Eigen::Vector3f::UnitZ());
  }
  bool top_at(const RelitPicture& p, int u, int v) const {
    const Eigen::Vector3f at_m = scene_.on_plane(u, v, 0.2f);
    return p.maps->mask.at(u, v) > 0.99f && std::abs(at_m.x()) < 0.09f && std::abs(at_m.y()) < 0.04f;
  }
  /// What a picture lost of the lamp's light on the top, mean over its pixels.
  float lost_by_top(const RelitPicture& before, const RelitPicture& with) const {
    double sum = 0, all = 0;
    for (int v = 0; v < scene_.height; ++v) {
      for (int u = 0; u < scene_.width; ++u) {
        if (!top_at(before, u, v)) continue;
        sum += static_cast<double>(picture_radiance(before, u, v) - picture_radiance(with, u, v));
        all += static_cast<double>(of_lamp(scene_.on_plane(u, v, 0.2f)));
      }
    }
    EXPECT_GT(all, 1);
    return static_cast<float>(sum / all);
  }
  /// What remains of the box's shadow on the floor.
  float left_of_shadow(const RelitPicture& before, const RelitPicture& with) const {
    double dark = 0, dark_now = 0;
    for (int v = 0; v < scene_.height; ++v) {
      for (int u = 0; u < scene_.width; ++u) {
        if (before.maps->mask.at(u, v) > 0 || !(depth_m_.at(u, v) > 0)) continue;
        if (kFloor - picture_radiance(before, u, v) < 0.03f) continue;
        dark += static_cast<double>(kFloor - picture_radiance(before, u, v));
        dark_now += static_cast<double>(kFloor - picture_radiance(with, u, v));
      }
    }
    EXPECT_GT(dark, 3);
    return static_cast<float>(dark_now / dark);
  }

  static constexpr float kFloor = 0.25f;  ///< radiance of box_on_floor
  static constexpr float kOpen = 0.5f;
  /// The room, and the lamp's light that the camera sees darkened to half of it everywhere around the box.
  reconstruct::Scene shadowed() const {
    reconstruct::Scene room = scene_.scene();
    reconstruct::LampShadow shadow;
    shadow.lamp = scene_.lamps[0].id;
    shadow.projection.origin_m = scene_.lamps[0].position_m;
    shadow.projection.axes = Eigen::Vector3f(1, -1, -1).asDiagonal();  // downwards
    shadow.min.setConstant(-3);
    shadow.cell = 0.25f;
    shadow.open = capture::Image<float>(25, 25, 1, kOpen);
    auto shadows = std::make_shared<reconstruct::LampShadows>();
    shadows->lamps.push_back(shadow);
    room.shadows = shadows;
    return room;
  }
  /// Half of the lamp's light leaves the box, and half of the shadow that it casts.
  void expect_half(const RelitPicture& before, const RelitPicture& with, float of_shadow) const {
    EXPECT_NEAR(lost_by_top(before, with), 1 - kOpen, 0.05f);
    EXPECT_NEAR(left_of_shadow(before, with), kOpen, of_shadow);
  }

  ClosedScene scene_;
  capture::Image<float> depth_m_;
};

TEST_P(OccludersOfNow, ShadowsThatTheCameraSeesAreOnObjectsAndNotTakenTwice) {
  const reconstruct::Scene open = scene_.scene();
  reconstruct::Scene dark = open;
  dark.shadows = shadowed().shadows;
  relight::Relighter relighter(device_, scene_.session());  // its pipelines take most of the time
  for (const relight::Plan& plan : plans()) {
    SCOPED_TRACE("at 1/" + std::to_string(plan.trace_scale));
    const RelitPicture before = relit(relighter, open, plan), with = relit(relighter, dark, plan),
                       after = relit(relighter, open, plan);
    expect_half(before, with, 0.15f);  // light that the box reflects into its shadow stays
    EXPECT_NEAR(lost_by_top(before, after), 0, 0.01f) << "they go at once";
  }
}

/// A hand between lamp and box that was fused and has left occludes nothing.
TEST_P(OccludersOfNow, SurfaceThatDepthSeesThroughOccludesNoLamp) {
  const Eigen::Vector3f middle_m = 0.5f * (scene_.lamps[0].position_m + Eigen::Vector3f(0.05f, 0, 0.2f));
  const Eigen::AlignedBox3f hand(middle_m - Eigen::Vector3f::Constant(0.06f),
                                 middle_m + Eigen::Vector3f::Constant(0.06f));
  ClosedScene held = scene_;
  held.distance = [floor = scene_.distance, hand](const Eigen::Vector3f& p) {
    return std::min(floor(p), box_distance(hand, p));
  };
  held.extent.extend(hand.max() + Eigen::Vector3f::Constant(0.05f));
  const reconstruct::Scene open = scene_.scene(), with_hand = held.scene();
  const auto check = [&](relight::Renderer& renderer, const relight::Plan& plan) {
    SCOPED_TRACE(plan.method + " at 1/" + std::to_string(plan.trace_scale));
    const RelitPicture before = relit(renderer, open, plan);
    const RelitPicture hidden = renderer.relight(held.frame(), with_hand, scene_.exhibit, plan, true),
                       gone = relit(renderer, with_hand, plan);
    ASSERT_GT(lost_by_top(before, hidden), 0.3f) << "it was between them";
    EXPECT_NEAR(lost_by_top(before, gone), 0, 0.1f) << "but for the light that the hand's surface still reflects";
    EXPECT_NEAR(left_of_shadow(before, gone), 1, 0.1f);
  };
  relight::Relighter relighter(device_, scene_.session());
  for (const relight::Plan& plan : plans()) check(relighter, plan);
  if (GetParam() != relight::gpu::Backend::vulkan) return;  // the reference uses none
  relight::Plan plan = rays_plan();
  plan.method = "reference";
  plan.samples = 32;
  relight::ReferenceRenderer reference(scene_.session());
  check(reference, plan);
}

TEST_P(OccludersOfNow, TheReferenceHasShadowsThatTheCameraSees) {
  if (GetParam() != relight::gpu::Backend::vulkan) GTEST_SKIP() << "the same for all devices: it uses none";
  relight::Plan plan = rays_plan();
  plan.method = "reference";
  plan.samples = 32;
  relight::ReferenceRenderer reference(scene_.session(), {});
  const RelitPicture before = relit(reference, scene_.scene(), plan), with = relit(reference, shadowed(), plan);
  expect_half(before, with, 0.05f);
}

ON_BOTH_DEVICES(OccludersOfNow);

}  // namespace
}  // namespace lumigraft::test
