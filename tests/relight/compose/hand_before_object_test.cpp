// Hands and people in front of objects, by all methods but `rays` (gather/foreground_test.cpp).
#include <algorithm>
#include <cmath>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using relight::RelitPicture;

constexpr float kHand_m = 0.3f;
const Eigen::Array3f kSkin(0.7f, 0.3f, 0.2f);

/// A white box on a floor; the hand in front of it is not in the room.
class HandBeforeObject {
 public:
  HandBeforeObject(relight::Renderer& renderer, relight::Plan plan, const ClosedScene& scene)
      : renderer_(renderer), plan_(std::move(plan)), scene_(scene), room_(scene.scene()), empty_(scene.frame()) {}

  /// A hand over the columns left of the picture's middle by 12 pixels to `right_px` right of it, all rows of the box;
  /// depth within `unknown_px` of that outline is not known.
  capture::FrameSet with_hand(float right_px, int unknown_px = 0) const {
    capture::FrameSet frame = empty_;
    auto depth = std::make_shared<capture::DepthFrame>(*frame.depth);
    auto color = std::make_shared<capture::Frame>(*frame.color);
    for (int v = 4; v < scene_.height - 4; ++v) {
      for (int u = middle() - 12; u < scene_.width; ++u) {
        const float inside_px = static_cast<float>(middle()) + right_px - static_cast<float>(u);  // of its right edge
        const float part = std::clamp(inside_px + 0.5f, 0.0f, 1.0f);
        for (int c = 0; c < 3; ++c) {
          float& light = color->radiance.at(u, v, c);
          light = part * kSkin[c] + (1 - part) * light;
        }
        if (inside_px > 0) depth->depth_m.at(u, v) = kHand_m;
        if (unknown_px > 0 && std::abs(inside_px) <= static_cast<float>(unknown_px)) depth->depth_m.at(u, v) = 0;
      }
    }
    frame.depth = depth;
    frame.color = color;
    return frame;
  }

  void is_hidden_at_once_and_shown_at_once() {
    const RelitPicture before = relit(empty_, true);
    ASSERT_GT(before.maps->mask.at(middle(), row()), 0.99f) << "the box is in the middle";
    const RelitPicture with = relit(with_hand(3), true), after = relit(empty_, true);
    for (int v = row() - 4; v < row() + 4; ++v) {
      for (int u = middle() - 9; u < middle(); ++u) EXPECT_LT(with.maps->mask.at(u, v), 0.01f) << u << ", " << v;
    }
    EXPECT_GT(with.maps->mask.at(middle() + 7, row()), 0.99f) << "next to the hand";
    EXPECT_EQ(after.maps->mask.data, before.maps->mask.data);
  }

  /// Without maps, so that what did not change is reused.
  void picture_follows_the_hand() {
    const RelitPicture before = relit(empty_, false);
    for (const int right_px : {3, -4, 3}) {
      SCOPED_TRACE(right_px);
      const RelitPicture with = relit(with_hand(static_cast<float>(right_px)), false);
      for (int v = row() - 4; v < row() + 4; ++v) {
        EXPECT_NEAR(picture_radiance(with, middle() + right_px - 4, v), kSkin[0], 0.1) << v;
        EXPECT_NEAR(picture_radiance(with, middle() + right_px + 5, v),
                    picture_radiance(before, middle() + right_px + 5, v), 0.03)
            << v;
      }
    }
    const RelitPicture after = relit(empty_, false);
    for (int v = row() - 4; v < row() + 4; ++v) {
      EXPECT_NEAR(picture_radiance(after, middle(), v), picture_radiance(before, middle(), v), 0.02) << v;
    }
  }

  void outline_is_divided() {
    for (const float part : {0.25f, 0.5f, 0.75f}) {  // of the pixel that the outline passes through
      const RelitPicture with = relit(with_hand(3 + part - 0.5f), true);
      for (int v = row() - 4; v < row() + 4; ++v) {
        EXPECT_NEAR(1 - with.maps->mask.at(middle() + 3, v), part, 0.15f) << v;
      }
    }
  }

  void unknown_depth_is_decided_by_colour() {
    const RelitPicture with = relit(with_hand(3.5f, 2), true);
    for (int v = row() - 4; v < row() + 4; ++v) {
      for (const int u : {2, 3}) EXPECT_LT(with.maps->mask.at(middle() + u, v), 0.2f) << u << ", " << v;
      for (const int u : {4, 5}) EXPECT_GT(with.maps->mask.at(middle() + u, v), 0.8f) << u << ", " << v;
    }
  }

  /// Part of the picture that the object covers, pixels, with the floor's depth off by this.
  double covered_px(float off_m) {
    capture::FrameSet frame = empty_;
    auto depth = std::make_shared<capture::DepthFrame>(*frame.depth);
    for (float& z : depth->depth_m.data) z += z > 0 ? off_m : 0;
    frame.depth = depth;
    const RelitPicture picture = relit(frame, true);
    double sum = 0;
    for (const float coverage : picture.maps->mask.data) sum += static_cast<double>(coverage);
    return sum;
  }

 private:
  int middle() const { return scene_.width / 2; }
  int row() const { return scene_.height / 2 - 6; }  // of the box
  RelitPicture relit(const capture::FrameSet& frame, bool with_maps) {
    return renderer_.relight(frame, room_, scene_.exhibit, plan_, with_maps);
  }

  relight::Renderer& renderer_;
  relight::Plan plan_;
  ClosedScene scene_;
  reconstruct::Scene room_;
  capture::FrameSet empty_;
};

/// A box that reaches `low_m` above the floor.
ClosedScene scene_with_box(float low_m = 0.01f) {
  ClosedScene scene = box_on_floor();
  scene.exhibit.objects = {box_object({-0.2f, -0.05f, low_m}, {0.2f, 0.05f, 0.2f}, 0.9f)};
  return scene;
}

std::vector<relight::Plan> plans() {
  std::vector<relight::Plan> plans{live_plan(), careful_plan(32, 1), live_plan()};
  plans[1].trace_scale = 2;
  plans[2].method = "dlpv";
  plans[2].trace_scale = 2;
  return plans;
}

class HandBeforeObjectOn : public ClosedTest {
 protected:
  template <typename Check>
  void with_all_plans(Check check) {
    const ClosedScene scene = scene_with_box();
    for (const relight::Plan& plan : plans()) {
      SCOPED_TRACE(plan.method + " at 1/" + std::to_string(plan.trace_scale));
      relight::Relighter relighter(device_, scene.session());
      HandBeforeObject hand(relighter, plan, scene);
      (hand.*check)();
    }
  }
};
ON_BOTH_DEVICES(HandBeforeObjectOn);

TEST_P(HandBeforeObjectOn, HidesItAtOnceAndGoesAtOnce) {
  with_all_plans(&HandBeforeObject::is_hidden_at_once_and_shown_at_once);
}
TEST_P(HandBeforeObjectOn, IsFollowedByThePicture) { with_all_plans(&HandBeforeObject::picture_follows_the_hand); }
TEST_P(HandBeforeObjectOn, DividesPixelsAtItsOutline) { with_all_plans(&HandBeforeObject::outline_is_divided); }
TEST_P(HandBeforeObjectOn, ColourDecidesWhereDepthIsUnknown) {
  with_all_plans(&HandBeforeObject::unknown_depth_is_decided_by_colour);
}

/// Depth that is off by no more than its noise cuts nothing off an object on the floor, nor does it uncover what is
/// below the floor.
void stays_cut_at_the_floor(relight::Renderer& renderer, const relight::Plan& plan) {
  constexpr float kOff_m = 0.008f;
  const ClosedScene standing = scene_with_box(0), sunk = scene_with_box(-0.1f);
  HandBeforeObject on_floor(renderer, plan, standing), below(renderer, plan, sunk);
  const double covered = on_floor.covered_px(0);
  ASSERT_GT(covered, 400);
  EXPECT_NEAR(on_floor.covered_px(-kOff_m), covered, 0.02 * covered);
  EXPECT_NEAR(on_floor.covered_px(kOff_m), covered, 0.02 * covered);
  EXPECT_NEAR(below.covered_px(0), covered, 0.04 * covered);
  EXPECT_NEAR(below.covered_px(kOff_m), covered, 0.02 * covered);
}

/// What a hand loses of its light by the box, W/sr/m², sum over the pixels of its top. It is not in the room.
double lost_by_hand(relight::Renderer& renderer, const relight::Plan& plan, const ClosedScene& scene,
                    const Eigen::AlignedBox3f& hand) {
  ClosedScene now = scene;
  now.distance = [floor = scene.distance, hand](const Eigen::Vector3f& p) {
    return std::min(floor(p), box_distance(hand, p));
  };
  now.extent.extend(hand);
  now.radiance = [](const Eigen::Vector3f& p) { return p.z() > 0.02f ? 0.15f : 0.25f; };
  const capture::FrameSet frame = now.frame();
  const RelitPicture picture = renderer.relight(frame, scene.scene(), scene.exhibit, plan, true);
  const Eigen::AlignedBox3f inside(hand.min() + Eigen::Vector3f::Constant(0.02f),
                                   hand.max() - Eigen::Vector3f::Constant(0.02f));
  double lost = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v, hand.max().z());
      if ((p.head<2>().array() < inside.min().head<2>().array()).any() ||
          (p.head<2>().array() > inside.max().head<2>().array()).any() || picture.maps->mask.at(u, v) > 0)
        continue;
      lost += static_cast<double>(frame.color->radiance.at(u, v, 0) - picture_radiance(picture, u, v));
    }
  }
  return lost;
}

TEST_P(HandBeforeObjectOn, TakesTheObjectsShadowAtOnce) {
  ClosedScene scene = box_on_floor();
  using Eigen::Vector3f;
  const Eigen::AlignedBox3f low(Vector3f(-0.32f, -0.1f, -0.01f), Vector3f(-0.13f, 0.08f, 0.08f)),
      between(Vector3f(0.06f, 0, 0.3f), Vector3f(0.2f, 0.12f, 0.34f));  // the lamp and the box
  relight::RayRenderer rays(scene.session());
  const double expected = lost_by_hand(rays, rays_plan(), scene, low);
  ASSERT_GT(expected, 1);
  const auto check = [&](const relight::Plan& plan, double times) {
    SCOPED_TRACE(plan.method + " at 1/" + std::to_string(plan.trace_scale));
    relight::Relighter relighter(device_, scene.session());
    EXPECT_NEAR(lost_by_hand(relighter, plan, scene, low) / (times * expected), 1, 0.25);
    EXPECT_NEAR(lost_by_hand(relighter, plan, scene, between) / (times * expected), 0, 0.05);
  };
  for (const relight::Plan& plan : plans()) {
    if (plan.trace_scale < 4) check(plan, 1);
  }
  // Normals of the live setting are those of depth over eight pixels: of one surface in finer pictures.
  scene.width *= 3;
  scene.height *= 3;
  scene.focal_px *= 3;
  check(live_plan(), 9);
}

TEST_P(HandBeforeObjectOn, LeavesContactToTheFusedFloor) {
  for (const relight::Plan& plan : plans()) {
    SCOPED_TRACE(plan.method + " at 1/" + std::to_string(plan.trace_scale));
    relight::Relighter relighter(device_, scene_with_box().session());
    stays_cut_at_the_floor(relighter, plan);
  }
}

class HandBeforeObjectTraced : public testing::Test {
 protected:
  HandBeforeObjectTraced() : renderer_(scene_.session()) { plan_.method = "reference"; }
  HandBeforeObject hand(int samples) {
    plan_.samples = samples;
    return {renderer_, plan_, scene_};
  }

  const ClosedScene scene_ = scene_with_box();
  relight::ReferenceRenderer renderer_;
  relight::Plan plan_;
};

TEST_F(HandBeforeObjectTraced, HidesItAtOnceAndGoesAtOnce) { hand(2).is_hidden_at_once_and_shown_at_once(); }
TEST_F(HandBeforeObjectTraced, DividesPixelsAtItsOutline) { hand(2).outline_is_divided(); }
TEST_F(HandBeforeObjectTraced, ColourDecidesWhereDepthIsUnknown) { hand(2).unknown_depth_is_decided_by_colour(); }
TEST_F(HandBeforeObjectTraced, LeavesContactToTheFusedFloor) {
  plan_.samples = 4;
  stays_cut_at_the_floor(renderer_, plan_);
}

/// The room still holds a hand that has gone: its surface hides nothing, and objects behind it have their light.
TEST_F(HandBeforeObjectTraced, FusedSurfaceThatTheCameraSeesThroughHidesNothing) {
  ClosedScene held = scene_;
  const Eigen::Vector3f hand_m = 0.4f * scene_.eye_m + Eigen::Vector3f(0, 0, 0.06f);
  const Eigen::AlignedBox3f hand(hand_m - Eigen::Vector3f::Constant(0.03f), hand_m + Eigen::Vector3f::Constant(0.03f));
  const auto floor = scene_.distance;
  held.distance = [=](const Eigen::Vector3f& p) { return std::min(floor(p), box_distance(hand, p)); };
  held.extent.extend(hand.max() + Eigen::Vector3f::Constant(0.05f));
  plan_.samples = 2;
  const reconstruct::Scene with_hand = held.scene(), without = scene_.scene();
  const capture::FrameSet empty = scene_.frame();
  const RelitPicture ghost = renderer_.relight(empty, with_hand, scene_.exhibit, plan_, true);
  const RelitPicture clear = renderer_.relight(empty, without, scene_.exhibit, plan_, true);
  capture::FrameSet no_depth = empty;
  no_depth.depth.reset();
  const RelitPicture hidden = renderer_.relight(no_depth, with_hand, scene_.exhibit, plan_, true);
  int behind = 0;
  double difference = 0;
  for (std::size_t i = 0; i < clear.maps->mask.data.size(); ++i) {
    EXPECT_NEAR(ghost.maps->mask.data[i], clear.maps->mask.data[i], 0.01f);
    if (hidden.maps->mask.data[i] > 0.01f || clear.maps->mask.data[i] < 0.99f) continue;
    difference += ghost.srgb.data[3 * i] - clear.srgb.data[3 * i];
    ++behind;
  }
  EXPECT_GT(behind, 50) << "the fused hand hides the box";
  EXPECT_LT(std::abs(difference / behind), 12);
}

/// A hand that hides the floor in the box's shadow gets none of it.
TEST_F(HandBeforeObjectTraced, TakesNoShadowOfTheFloorBehindIt) {
  plan_.samples = 16;
  const reconstruct::Scene room = scene_.scene();
  const capture::FrameSet empty = scene_.frame();
  const RelitPicture before = renderer_.relight(empty, room, scene_.exhibit, plan_, true);
  capture::FrameSet frame = empty;
  auto depth = std::make_shared<capture::DepthFrame>(*empty.depth);
  const int side_px = 70, left = (scene_.width - side_px) / 2, top = (scene_.height - side_px) / 2;
  for (int v = top; v < top + side_px; ++v) std::fill_n(&depth->depth_m.at(left, v), side_px, kHand_m);
  frame.depth = depth;
  const RelitPicture with = renderer_.relight(frame, room, scene_.exhibit, plan_, true);
  double shadow = 0, on_hand = 0;
  for (int v = top + 6; v < top + side_px - 6; ++v) {
    for (int u = left + 6; u < left + side_px - 6; ++u) {
      if (before.maps->delta.at(u, v, 0) > -0.02f) continue;
      shadow += static_cast<double>(before.maps->delta.at(u, v, 0));
      on_hand += static_cast<double>(with.maps->delta.at(u, v, 0));
    }
  }
  ASSERT_LT(shadow, -1);
  EXPECT_GT(on_hand, 0.2 * shadow);
}

/// A hand between the lamp and the box, which is not in the room yet.
TEST_F(HandBeforeObjectTraced, CastsItsShadowOnItAtOnce) {
  plan_.samples = 16;
  ClosedScene wide = scene_;
  wide.width *= 3;
  wide.height *= 3;
  wide.focal_px *= 3;
  wide.extent.extend(Eigen::Vector3f(0.9f, 1.6f, 0));
  ClosedScene held = wide;
  const Eigen::Vector3f hand_m = 0.5f * (wide.lamps[0].position_m + Eigen::Vector3f(0.05f, 0, 0.2f));
  const Eigen::AlignedBox3f hand(hand_m - Eigen::Vector3f::Constant(0.06f), hand_m + Eigen::Vector3f::Constant(0.06f));
  const auto floor = wide.distance;
  held.distance = [=](const Eigen::Vector3f& p) { return std::min(floor(p), box_distance(hand, p)); };
  held.extent.extend(hand.max() + Eigen::Vector3f::Constant(0.05f));
  relight::ReferenceRenderer renderer(wide.session());
  const reconstruct::Scene room = wide.scene();
  const RelitPicture before = renderer.relight(wide.frame(), room, wide.exhibit, plan_, true);
  const RelitPicture with = renderer.relight(held.frame(), room, wide.exhibit, plan_, true);
  double darker = 0;
  int pixels = 0;
  for (std::size_t i = 0; i < before.maps->mask.data.size(); ++i) {
    if (before.maps->mask.data[i] < 0.99f || with.maps->mask.data[i] < 0.99f) continue;
    darker += std::max(before.srgb.data[3 * i] - with.srgb.data[3 * i], 0);
    ++pixels;
  }
  ASSERT_GT(pixels, 200);
  EXPECT_GT(darker / pixels, 4);
}

}  // namespace
}  // namespace lumigraft::test
