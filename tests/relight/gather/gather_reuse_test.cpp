// Delta final gathering over several frames: what is cached, what is updated, what must not change.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

void turn(relight::Exhibit& exhibit, double degrees) {
  exhibit.objects.front().rotation = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitZ());
}

double rms_codes(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - b.data[i], 2);
  return std::sqrt(sum / static_cast<double>(a.data.size()));
}

bool traced_light(const relight::RelitPicture& picture) {
  return std::any_of(picture.passes.begin(), picture.passes.end(),
                     [](const relight::gpu::PassTime& pass) { return pass.name == "objects" || pass.name == "cells"; });
}

TEST(RaysKept, AStillPictureIsNotTracedAgain) {
  ClosedScene scene = box_on_floor();
  relight::RayRenderer renderer(scene.session());
  const capture::FrameSet frame = scene.frame();
  const reconstruct::Scene room = scene.scene();
  const relight::RelitPicture first = renderer.relight(frame, room, scene.exhibit, rays_plan());
  EXPECT_TRUE(traced_light(first));
  const relight::RelitPicture again = renderer.relight(frame, room, scene.exhibit, rays_plan());
  EXPECT_TRUE(again.passes.empty());
  EXPECT_EQ(again.srgb.data, first.srgb.data);
  relight::RayRenderer other(scene.session());
  EXPECT_EQ(other.relight(frame, room, scene.exhibit, rays_plan()).srgb.data, first.srgb.data);
}

TEST(RaysKept, ACameraThatMovesAloneGathersNothingOnSurfaces) {
  ClosedScene scene = box_on_floor();
  relight::RayRenderer renderer(scene.session());
  reconstruct::Scene room = scene.scene();
  renderer.relight(scene.frame(), room, scene.exhibit, rays_plan());
  scene.eye_m.x() += 0.05f;
  room.pose = scene.scene().pose;
  const capture::FrameSet frame = scene.frame();
  const relight::RelitPicture moved = renderer.relight(frame, room, scene.exhibit, rays_plan());
  EXPECT_FALSE(traced_light(moved));
  EXPECT_FALSE(moved.passes.empty());
  relight::RayRenderer other(scene.session());
  EXPECT_EQ(other.relight(frame, room, scene.exhibit, rays_plan()).srgb.data, moved.srgb.data);
}

TEST(RaysKept, ACameraThatTremblesIsStill) {
  ClosedScene scene = box_on_floor();
  relight::RayRenderer renderer(scene.session());
  reconstruct::Scene room = scene.scene();
  const relight::RelitPicture first = renderer.relight(scene.frame(), room, scene.exhibit, rays_plan());
  const Eigen::Isometry3d still = room.pose->T_tag_camera;
  for (int i = 0; i < 8; ++i) {
    room.pose->T_tag_camera = still;
    room.pose->T_tag_camera.translate(1e-4 * Eigen::Vector3d(std::cos(i), std::sin(i), 0.5));
    room.pose->T_tag_camera.rotate(Eigen::AngleAxisd(3e-4 * std::sin(2 * i), Eigen::Vector3d::UnitZ()));
    const relight::RelitPicture again = renderer.relight(scene.frame(), room, scene.exhibit, rays_plan());
    EXPECT_TRUE(again.passes.empty());
    EXPECT_EQ(again.srgb.data, first.srgb.data);
  }
}

TEST(RaysKept, WithoutAnObjectInReachNoBitChanges) {
  ClosedScene scene = box_on_floor();
  capture::FrameSet frame = scene.frame();
  auto color = std::make_shared<capture::Frame>();
  color->exposure = 1.3;
  color->encoded = capture::Image<std::uint8_t>(scene.width, scene.height, 3);
  for (std::size_t i = 0; i < color->encoded.data.size(); ++i) {
    color->encoded.data[i] = static_cast<std::uint8_t>(i * 7 + i / 251);
  }
  frame.color = color;
  relight::RayRenderer renderer(scene.session());
  scene.exhibit.objects.front().position_m = {0, -20, 0.12};
  EXPECT_EQ(renderer.relight(frame, scene.scene(), scene.exhibit, rays_plan()).srgb.data, color->encoded.data);
  scene.exhibit.objects.front().visible = false;
  const relight::RelitPicture without = renderer.relight(frame, scene.scene(), scene.exhibit, rays_plan());
  EXPECT_EQ(without.srgb.data, color->encoded.data);
  EXPECT_TRUE(without.passed_through);
}

// Each later bounce lags by one frame; a small error, only during motion.
TEST(RaysKept, WhatTurnsGoesOnFromTheLastFrame) {
  ClosedScene scene = box_on_floor();
  relight::RayRenderer renderer(scene.session());
  const capture::FrameSet frame = scene.frame();
  const reconstruct::Scene room = scene.scene();
  for (int i = 0; i < 5; ++i) {
    turn(scene.exhibit, i);
    const capture::Image<std::uint8_t> moving = renderer.relight(frame, room, scene.exhibit, rays_plan()).srgb;
    relight::RayRenderer other(scene.session());
    EXPECT_LT(rms_codes(moving, other.relight(frame, room, scene.exhibit, rays_plan(2, 20, 4)).srgb), 0.5) << i;
  }
}

// Live, light is updated in cycles of frames; after motion stops, the picture equals that of a scene that was always
// static.
TEST(RaysKept, LiveLightFollowsInRounds) {
  for (const int trace_scale : {4, 8, 16}) {
    SCOPED_TRACE(trace_scale);
    ClosedScene scene = box_on_floor();
    scene.width *= 2;
    scene.height *= 2;
    scene.focal_px *= 2;
    const relight::Plan live = rays_plan(trace_scale, 20, 4);
    relight::RayRenderer renderer(scene.session());
    const capture::FrameSet frame = scene.frame();
    const reconstruct::Scene room = scene.scene();
    const auto anew = [&] {
      relight::RayRenderer other(scene.session());
      return other.relight(frame, room, scene.exhibit, live).srgb;
    };
    renderer.relight(frame, room, scene.exhibit, live);
    for (int i = 1; i < 12; ++i) {
      turn(scene.exhibit, 2 * i);
      const capture::Image<std::uint8_t> moving = renderer.relight(frame, room, scene.exhibit, live).srgb;
      if (i < 11) continue;
      EXPECT_LT(rms_codes(moving, anew()), 1);
    }
    relight::RelitPicture rested;
    int rounds = 0;
    do {
      rested = renderer.relight(frame, room, scene.exhibit, live);
    } while (!rested.passes.empty() && ++rounds < 20);
    EXPECT_EQ(rounds, 7);
    EXPECT_LT(rms_codes(rested.srgb, anew()), 0.5);
  }
}

/// A second, invisible box next to the first.
ClosedScene two_boxes_on_floor() {
  ClosedScene scene = box_on_floor();
  scene.exhibit.objects.push_back(box_object({0.15f, -0.1f, 0.01f}, {0.25f, 0.05f, 0.12f}, 0.7f));
  scene.exhibit.objects[1].visible = false;
  return scene;
}

std::ptrdiff_t rounds_in(const relight::RelitPicture& picture) {
  return std::count_if(picture.passes.begin(), picture.passes.end(),
                       [](const relight::gpu::PassTime& pass) { return pass.name == "cells"; });
}

// Live, an object that appears or disappears changes light in cycles of frames: no frame solves all of it.
TEST(RaysKept, LiveLightFollowsWhatComesAndGoesInRounds) {
  ClosedScene scene = two_boxes_on_floor();
  const relight::Plan live = rays_plan(8);
  const capture::FrameSet frame = scene.frame();
  const reconstruct::Scene room = scene.scene();
  relight::RayRenderer renderer(scene.session());
  const auto relit = [&] { return renderer.relight(frame, room, scene.exhibit, live); };
  relit();
  for (const bool shown : {true, false, true}) {
    SCOPED_TRACE(shown);
    scene.exhibit.objects[1].visible = shown;
    relight::RayRenderer other(scene.session());
    const capture::Image<std::uint8_t> wanted = other.relight(frame, room, scene.exhibit, live).srgb;
    relight::RelitPicture picture = relit();
    EXPECT_LE(rounds_in(picture), 1);
    EXPECT_LT(rms_codes(picture.srgb, wanted), 3) << "in its first frame it has its light, and its shadow";
    int frames = 1;
    for (; !picture.passes.empty() && frames < 200; ++frames) {
      picture = relit();
      EXPECT_LE(rounds_in(picture), 1);
    }
    EXPECT_LT(frames, 100);
    EXPECT_LT(rms_codes(picture.srgb, wanted), 0.5) << "as if it had always been so";
  }
}

// Without the live setting each picture is independent of earlier ones.
TEST(RaysKept, WhatComesAndGoesIsSolvedAtOnceOffline) {
  ClosedScene scene = two_boxes_on_floor();
  const capture::FrameSet frame = scene.frame();
  const reconstruct::Scene room = scene.scene();
  relight::RayRenderer renderer(scene.session());
  for (const bool shown : {false, true, false}) {
    scene.exhibit.objects[1].visible = shown;
    relight::RayRenderer other(scene.session());
    EXPECT_EQ(renderer.relight(frame, room, scene.exhibit, rays_plan()).srgb.data,
              other.relight(frame, room, scene.exhibit, rays_plan()).srgb.data);
    EXPECT_TRUE(renderer.relight(frame, room, scene.exhibit, rays_plan()).passes.empty());
  }
}

// Far from the object nothing, including noise, should change when it rotates by a degree.
TEST(RaysKept, PixelsThatShouldNotChangeDoNot) {
  ClosedScene scene = box_on_floor();
  relight::RayRenderer renderer(scene.session());
  const capture::FrameSet frame = scene.frame();
  const reconstruct::Scene room = scene.scene();
  capture::Image<std::uint8_t> last = renderer.relight(frame, room, scene.exhibit, rays_plan()).srgb;
  double sum = 0;
  int count = 0;
  for (int i = 1; i < 6; ++i) {
    turn(scene.exhibit, i);
    const capture::Image<std::uint8_t> now = renderer.relight(frame, room, scene.exhibit, rays_plan()).srgb;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        if (scene.on_plane(u, v).head<2>().norm() < 0.35f) continue;
        sum += std::pow(now.at(u, v) - last.at(u, v), 2);
        ++count;
      }
    }
    last = now;
  }
  EXPECT_GT(count, 1000);
  EXPECT_LT(std::sqrt(sum / count), 0.7);
}

}  // namespace
}  // namespace lumigraft::test
