// Hands and people in front of objects: what depth shows at once.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using relight::Rgb;

/// A white box on a floor; what depth shows before it is not in the room.
class HandBeforeBox : public testing::Test {
 protected:
  HandBeforeBox() : scene_(box_on_floor()), renderer_(scene_.session()) {}

  /// The floor's depth, with a square of `side_px` at `hand_m` in the middle of the picture.
  capture::FrameSet with_hand(float hand_m, int side_px = 24) const {
    capture::FrameSet frame = scene_.frame();
    auto depth = std::make_shared<capture::DepthFrame>(*frame.depth);
    auto color = std::make_shared<capture::Frame>(*frame.color);
    for (int v = (scene_.height - side_px) / 2; v < (scene_.height + side_px) / 2; ++v) {
      for (int u = (scene_.width - side_px) / 2; u < (scene_.width + side_px) / 2; ++u) {
        depth->depth_m.at(u, v) = hand_m;
        for (int c = 0; c < 3; ++c) color->radiance.at(u, v, c) = 0.8f;
      }
    }
    frame.depth = depth;
    frame.color = color;
    return frame;
  }
  relight::RelitPicture relit(const capture::FrameSet& frame, const reconstruct::Scene& room) {
    return renderer_.relight(frame, room, scene_.exhibit, rays_plan(), true);
  }

  /// The scene with a hand between the lamp and the box, and floor behind it.
  ClosedScene with_hand_at_lamp() {
    scene_.extent.extend(Eigen::Vector3f(0.9f, 1.6f, 0));
    ClosedScene held = scene_;
    const Eigen::Vector3f hand_m = 0.5f * (scene_.lamps[0].position_m + Eigen::Vector3f(0.05f, 0, 0.2f));
    const Eigen::AlignedBox3f hand(hand_m - Eigen::Vector3f::Constant(0.06f),
                                   hand_m + Eigen::Vector3f::Constant(0.06f));
    const auto floor = scene_.distance;
    held.distance = [=](const Eigen::Vector3f& p) { return std::min(floor(p), box_distance(hand, p)); };
    held.extent.extend(hand.max() + Eigen::Vector3f::Constant(0.05f));
    return held;
  }

  ClosedScene scene_;
  relight::RayRenderer renderer_;
};

TEST_F(HandBeforeBox, HidesItAtOnceAndGoesAtOnce) {
  const reconstruct::Scene room = scene_.scene();
  const relight::RelitPicture before = relit(scene_.frame(), room);
  ASSERT_GT(before.maps->mask.at(scene_.width / 2, scene_.height / 2), 0.99f) << "the box is in the middle";
  const capture::FrameSet frame = with_hand(0.3f);
  const relight::RelitPicture with = relit(frame, room);
  for (int v = -8; v < 8; ++v) {
    for (int u = -8; u < 8; ++u) {
      EXPECT_LT(with.maps->mask.at(scene_.width / 2 + u, scene_.height / 2 + v), 0.01f);
    }
  }
  const relight::RelitPicture after = relit(scene_.frame(), room);
  EXPECT_EQ(after.srgb.data, before.srgb.data);
}

TEST_F(HandBeforeBox, BehindItHidesNothing) {
  const reconstruct::Scene room = scene_.scene();
  const float far_m = scene_.frame().depth->depth_m.at(scene_.width / 2, scene_.height / 2);
  const relight::RelitPicture with = relit(with_hand(far_m + 0.05f), room);
  const relight::RelitPicture without = relit(scene_.frame(), room);
  for (std::size_t i = 0; i < without.maps->mask.data.size(); ++i) {
    EXPECT_NEAR(with.maps->mask.data[i], without.maps->mask.data[i], 0.01f);
  }
}

TEST_F(HandBeforeBox, CastsItsShadowOnItAtOnce) {
  // Fine enough that neighbouring pixels on the hand's top are of one surface.
  scene_.width *= 3;
  scene_.height *= 3;
  scene_.focal_px *= 3;
  const ClosedScene held = with_hand_at_lamp();
  relight::RayRenderer renderer(scene_.session());
  const reconstruct::Scene room = scene_.scene();  // it does not have the hand
  const relight::RelitPicture before = renderer.relight(scene_.frame(), room, scene_.exhibit, rays_plan(), true);
  const relight::RelitPicture with = renderer.relight(held.frame(), room, scene_.exhibit, rays_plan(), true);
  double darker = 0;
  int pixels = 0;
  for (int v = 0; v < scene_.height; ++v) {
    for (int u = 0; u < scene_.width; ++u) {
      if (before.maps->mask.at(u, v) < 0.99f || with.maps->mask.at(u, v) < 0.99f) continue;
      if (before.maps->normals.at(u, v, 2) < 0.99f) continue;
      darker += before.srgb.at(u, v, 0) - with.srgb.at(u, v, 0);
      ++pixels;
    }
  }
  ASSERT_GT(pixels, 20) << "the top of the box";
  EXPECT_GT(darker / pixels, 10);
}

TEST_F(HandBeforeBox, TakesNoShadowOfTheFloorBehindIt) {
  const reconstruct::Scene room = scene_.scene();
  const relight::RelitPicture before = relit(scene_.frame(), room);
  const int side_px = 70;
  const relight::RelitPicture with = relit(with_hand(0.3f, side_px), room);
  int shaded = 0;
  for (int v = (scene_.height - side_px) / 2 + 6; v < (scene_.height + side_px) / 2 - 6; ++v) {
    for (int u = (scene_.width - side_px) / 2 + 6; u < (scene_.width + side_px) / 2 - 6; ++u) {
      if (before.maps->delta.at(u, v, 0) > -0.02f) continue;
      EXPECT_GT(with.maps->delta.at(u, v, 0), 0.2f * before.maps->delta.at(u, v, 0)) << u << ", " << v;
      ++shaded;
    }
  }
  EXPECT_GT(shaded, 20);
}

TEST_F(HandBeforeBox, FusedSurfaceThatTheCameraSeesThroughHidesNothing) {
  const ClosedScene held = with_hand_at_lamp();  // the room still holds the hand
  const relight::RelitPicture ghost = relit(scene_.frame(), held.scene());
  relight::RayRenderer other(scene_.session());
  const relight::RelitPicture without =
      other.relight(scene_.frame(), scene_.scene(), scene_.exhibit, rays_plan(), true);
  double sum = 0;
  for (std::size_t i = 0; i < without.srgb.data.size(); ++i) {
    sum += std::pow(static_cast<double>(ghost.srgb.data[i]) - without.srgb.data[i], 2);
  }
  for (std::size_t i = 0; i < without.maps->mask.data.size(); ++i) {
    EXPECT_NEAR(ghost.maps->mask.data[i], without.maps->mask.data[i], 0.01f);
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(without.srgb.data.size())), 1.5) << "nor does it hide lamps";
}

/// A person who has just left the view of the box's shadow is still fused, and depth is noisy: half of its points are
/// below the fused floor.
TEST_F(HandBeforeBox, TheFloorThatItUncoversIsTheFusedOneAndNotInItsOwnShadow) {
  const Eigen::Vector3f dark_m(-0.22f, -0.08f, 0);
  const Eigen::Vector3f middle_m = dark_m + 0.5f * (scene_.eye_m - dark_m);
  const Eigen::AlignedBox3f person(middle_m - Eigen::Vector3f::Constant(0.05f),
                                   middle_m + Eigen::Vector3f::Constant(0.05f));
  ClosedScene held = scene_;
  held.distance = [floor = scene_.distance, person](const Eigen::Vector3f& p) {
    return std::min(floor(p), box_distance(person, p));
  };
  held.extent.extend(person.max() + Eigen::Vector3f::Constant(0.05f));
  capture::FrameSet frame = scene_.frame();
  const capture::FrameSet covered = held.frame();
  auto depth = std::make_shared<capture::DepthFrame>(*frame.depth);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> off_m(-0.006f, 0.006f);
  for (float& z : depth->depth_m.data) z += z > 0 ? off_m(random) : 0;
  frame.depth = depth;
  const relight::RelitPicture expected = relit(frame, scene_.scene());
  relight::RayRenderer other(scene_.session());
  const relight::RelitPicture found = other.relight(frame, held.scene(), scene_.exhibit, rays_plan(), true);
  double shadow = 0, shadow_found = 0, off = 0;
  for (std::size_t i = 0; i < depth->depth_m.data.size(); ++i) {
    if (covered.depth->depth_m.data[i] > depth->depth_m.data[i] - 0.1f) continue;  // it was not hidden
    shadow += static_cast<double>(expected.maps->delta.data[3 * i]);
    shadow_found += static_cast<double>(found.maps->delta.data[3 * i]);
    off += std::abs(static_cast<double>(expected.maps->delta.data[3 * i] - found.maps->delta.data[3 * i]));
  }
  ASSERT_LT(shadow, -5);
  EXPECT_NEAR(shadow_found / shadow, 1, 0.05);
  EXPECT_LT(off, -0.1 * shadow);
}

/// A hand that came to rest in the box's shadow. Fusion holds half of it, a few millimetres off and in the floor's
/// colour: as long as that is so it has the surface and colour that the frame shows.
void is_as_the_frame_shows_it_while_half_fused(relight::Renderer& renderer, const relight::Plan& plan) {
  const ClosedScene scene = box_on_floor();
  const auto with_hand = [&](float top_m) {
    const Eigen::AlignedBox3f hand(Eigen::Vector3f(-0.34f, -0.1f, -0.01f), Eigen::Vector3f(-0.14f, 0.08f, top_m));
    ClosedScene held = scene;
    held.distance = [floor = scene.distance, hand](const Eigen::Vector3f& p) {
      return std::min(floor(p), box_distance(hand, p));
    };
    return held;
  };
  constexpr float kTop_m = 0.05f;
  ClosedScene now = with_hand(kTop_m);
  now.radiance = [](const Eigen::Vector3f& p) { return p.z() > 0.02f ? 0.35f : 0.25f; };
  const auto room_of = [&](const ClosedScene& held) {
    reconstruct::Scene room = held.scene();
    auto field = std::make_shared<reconstruct::DistanceField>(*room.field);
    for (const auto& [key, brick] : room.field->bricks) {
      auto weighted = std::make_shared<reconstruct::FieldBrick>(*brick);
      for (int i = 0; i < reconstruct::kBrickVoxels; ++i) {
        const Eigen::Vector3f p = field->voxel_m * reconstruct::voxel_in(key, i).cast<float>();
        float& weight = weighted->weight[static_cast<std::size_t>(i)];
        const bool of_floor = held.distance(p) >= scene.distance(p) - 1e-4f;
        weight *= of_floor ? 64 : 0.3f;
      }
      field->bricks[key] = weighted;
    }
    room.field = field;
    return room;
  };
  const capture::FrameSet frame = now.frame();
  const relight::RelitPicture unfused = renderer.relight(frame, room_of(scene), scene.exhibit, plan, true),
                              half = renderer.relight(frame, room_of(with_hand(kTop_m + 0.004f)), scene.exhibit, plan,
                                                      true);
  double on_hand = 0, on_hand_half = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v, kTop_m);
      if (p.x() < -0.32f || p.x() > -0.16f || p.y() < -0.08f || p.y() > 0.06f || unfused.maps->mask.at(u, v) > 0)
        continue;
      on_hand += static_cast<double>(unfused.maps->delta.at(u, v, 0));
      on_hand_half += static_cast<double>(half.maps->delta.at(u, v, 0));
    }
  }
  ASSERT_LT(on_hand, -4) << plan.method;
  EXPECT_NEAR(on_hand_half / on_hand, 1, 0.1) << plan.method;
}

TEST(HalfFusedHand, IsAsTheFrameShowsItByRays) {
  relight::RayRenderer renderer(box_on_floor().session());
  is_as_the_frame_shows_it_while_half_fused(renderer, rays_plan());
}

TEST(HalfFusedHand, IsAsTheFrameShowsItByTheReference) {
  relight::ReferenceRenderer renderer(box_on_floor().session());
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = 16;
  is_as_the_frame_shows_it_while_half_fused(renderer, plan);
}

/// A shadow that covers everything: `open` of the lamp's light arrives.
std::shared_ptr<const reconstruct::LampShadows> shadow_over_all(const reconstruct::PointLight& lamp, float open) {
  reconstruct::LampShadow shadow{.lamp = lamp.id, .projection = {}, .open = {}};
  shadow.projection.origin_m = lamp.position_m;
  shadow.projection.axes << Eigen::Vector3f::UnitX().transpose(), -Eigen::Vector3f::UnitY().transpose(),
      -Eigen::Vector3f::UnitZ().transpose();
  shadow.min.setConstant(-3);
  shadow.cell = 6;
  shadow.open = capture::Image<float>(2, 2, 1, open);
  return std::make_shared<const reconstruct::LampShadows>(reconstruct::LampShadows{{shadow}});
}

TEST_F(HandBeforeBox, ShadowsOfWhatNoCameraSeesAreOnItAtOnce) {
  reconstruct::Scene room = scene_.scene();
  const relight::RelitPicture lit = relit(scene_.frame(), room);
  ClosedScene without = scene_;
  without.lamps.clear();
  relight::RayRenderer other(without.session());
  const relight::RelitPicture unlit = other.relight(scene_.frame(), without.scene(), scene_.exhibit, rays_plan(), true);
  for (const float open : {0.0f, 0.5f}) {
    room.shadows = shadow_over_all(scene_.lamps[0], open);
    const relight::RelitPicture shaded = relit(scene_.frame(), room);
    double object = 0, floor = 0, most_object = 0, most_floor = 0;
    for (int v = 0; v < scene_.height; ++v) {
      for (int u = 0; u < scene_.width; ++u) {
        const bool on_object = lit.maps->mask.at(u, v) > 0.99f;
        if (!on_object && lit.maps->mask.at(u, v) > 0.01f) continue;
        const auto light = [&](const relight::RelitPicture& picture) {
          return static_cast<double>(on_object ? picture_radiance(picture, u, v) : picture.maps->delta.at(u, v, 0));
        };
        const double expected = light(unlit) + open * (light(lit) - light(unlit));
        (on_object ? object : floor) += std::pow(light(shaded) - expected, 2);
        (on_object ? most_object : most_floor) += std::pow(light(lit) - light(unlit), 2);
      }
    }
    EXPECT_LT(std::sqrt(object / most_object), 0.1) << open;
    EXPECT_LT(std::sqrt(floor / most_floor), 0.1) << open;
  }
  room.shadows = nullptr;
  const relight::RelitPicture again = relit(scene_.frame(), room);
  double off = 0;
  for (std::size_t i = 0; i < lit.srgb.data.size(); ++i) off += std::abs(lit.srgb.data[i] - again.srgb.data[i]);
  EXPECT_LT(off / static_cast<double>(lit.srgb.data.size()), 0.5) << "and go at once";
}

/// Depth that is wrong in all pixels.
TEST_F(HandBeforeBox, WrongDepthIsDrawnAsItIs) {
  const reconstruct::Scene room = scene_.scene();
  const relight::RelitPicture before = relit(scene_.frame(), room);
  const auto with_depth = [&](float depth_m) {
    capture::FrameSet frame = scene_.frame();
    auto depth = std::make_shared<capture::DepthFrame>(*frame.depth);
    std::fill(depth->depth_m.data.begin(), depth->depth_m.data.end(), depth_m);
    frame.depth = depth;
    return relit(frame, room);
  };
  EXPECT_EQ(with_depth(0).maps->mask.data, before.maps->mask.data) << "unknown: the fused room decides";
  for (const float depth_m : {0.02f, 0.3f}) {  // a hand that touches the lens, a person who fills the picture
    const relight::RelitPicture hidden = with_depth(depth_m);
    for (const float coverage : hidden.maps->mask.data) ASSERT_LT(coverage, 0.01f) << depth_m;
  }
  for (const float depth_m : {std::numeric_limits<float>::quiet_NaN(), -1.0f, 1e9f}) {
    const relight::RelitPicture picture = with_depth(depth_m);
    for (const float coverage : picture.maps->mask.data) ASSERT_TRUE(coverage >= 0 && coverage <= 1) << depth_m;
    for (const float delta : picture.maps->delta.data) ASSERT_TRUE(std::isfinite(delta)) << depth_m;
  }
  const relight::RelitPicture after = relit(scene_.frame(), room);
  EXPECT_EQ(after.srgb.data, before.srgb.data) << "nothing is left of it";
}

/// The hand of colour is where that of depth will be three frames later.
TEST_F(HandBeforeBox, DepthThatLagsTearsNoObject) {
  const reconstruct::Scene room = scene_.scene();
  for (const int lag_px : {2, 6, 12}) {
    capture::FrameSet frame = with_hand(0.3f);
    auto depth = std::make_shared<capture::DepthFrame>(*frame.depth);
    for (int v = 0; v < scene_.height; ++v) {
      for (int u = 0; u < scene_.width; ++u)
        depth->depth_m.at(u, v) = frame.depth->depth_m.at(std::max(u - lag_px, 0), v);
    }
    frame.depth = depth;
    const relight::RelitPicture picture = relit(frame, room);
    // One hole of the hand's size, with nothing of the object inside and no holes outside.
    int hidden = 0;
    const relight::RelitPicture whole = relit(scene_.frame(), room);
    for (std::size_t i = 0; i < picture.maps->mask.data.size(); ++i) {
      if (whole.maps->mask.data[i] > 0.99f && picture.maps->mask.data[i] < 0.5f) ++hidden;
    }
    EXPECT_LT(hidden, 24 * 24 * 1.2) << lag_px;
    EXPECT_GT(hidden, 0) << lag_px;
  }
}

}  // namespace
}  // namespace lumigraft::test
