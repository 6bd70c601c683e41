// The camera is found again by views that were kept, and a room without a tag has a world of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "capture/error.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/kept_room/keyframe_file.h"
#include "reconstruct/pose/keyframe_map.h"
#include "reconstruct/pose/pose.h"
#include "reconstruct/pose/surface_anchor.h"
#include "tests/reconstruct/pose/textured_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using test::kDegree;

Isometry3d on_arc(double angle_rad) {
  return test::looking_at_tag(1.3, 50 * kDegree, -1.6 + angle_rad, {0.0, 0.15, 0.1});
}

TestRoom large_room() {
  TestRoom room = test::furnished_room();
  room.half_m = 3;
  return room;
}

capture::FrameSet at(capture::FrameSet frame, std::uint64_t index) {
  frame.index = index;
  frame.time_ns = static_cast<std::int64_t>(index) * test::kFrameNs;
  return frame;
}

/// The frame with a tag on the floor, at the origin of `T_tag_camera`.
capture::FrameSet with_tag(capture::FrameSet frame, const capture::CameraModel& camera,
                           const Isometry3d& T_tag_camera) {
  const TagFinder finder(test::some_tag());
  const capture::Frame tag = test::view_of_tag(camera, finder.pattern(), 0.16, T_tag_camera);
  auto color = std::make_shared<capture::Frame>(*frame.color);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Vector3d d = T_tag_camera.linear() * *camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      const Vector3d p = T_tag_camera.translation() - T_tag_camera.translation().z() / d.z() * d;
      if (d.z() < 0 && p.cwiseAbs().maxCoeff() < 0.11)
        for (int c = 0; c < 3; ++c) color->encoded.at(u, v, c) = tag.encoded.at(u, v, c);
    }
  frame.color = color;
  return frame;
}

TEST(Relocation, ViewsLocateTheCameraWithinTheirCovariance) {
  const capture::CameraModel camera = test::small_camera();
  const TestRoom room = large_room();
  KeyframeMap map(camera);
  for (const double angle : {0.0, 0.3, 0.6})
    map.add(test::textured_view(room, camera, on_arc(angle), 1), {on_arc(angle), 1e-8 * PoseCovariance::Identity()});
  ASSERT_EQ(map.views().size(), 3u);
  map.add(test::textured_view(room, camera, on_arc(0.02), 1), {on_arc(0.02), 1e-8 * PoseCovariance::Identity()});
  EXPECT_EQ(map.views().size(), 3u) << "the same view again";
  double worst_mm = 0, worst_sigmas = 0;
  for (const double angle : {-0.1, 0.1, 0.2, 0.45, 0.7}) {
    const Isometry3d truth = on_arc(angle);
    const auto found = map.locate(*test::textured_view(room, camera, truth, 7).color);
    ASSERT_TRUE(found) << angle;
    const double off_mm = test::millimetres_apart(found->pose.T_tag_camera, truth);
    worst_mm = std::max(worst_mm, off_mm);
    worst_sigmas = std::max(worst_sigmas, 1e-3 * off_mm / position_sigma_m(found->pose.covariance));
  }
  std::printf("relocation: views between others: at most %.1f mm off, %.2f sigma\n", worst_mm, worst_sigmas);
  EXPECT_LT(worst_mm, 12);
  EXPECT_LT(worst_sigmas, 1.5);
}

// Views survive a restart as a file; one that cannot be used is refused with its reason.
TEST(Relocation, ViewsAreReadFromAFile) {
  const capture::CameraModel camera = test::small_camera();
  const TestRoom room = large_room();
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "views";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "kiosk.views.yml.gz";
  KeyframeMap map(camera);
  for (const double angle : {0.0, 0.4})
    map.add(test::textured_view(room, camera, on_arc(angle), 1), {on_arc(angle), 1e-8 * PoseCovariance::Identity()});
  write_views(file, map.views(), test::some_tag(), camera);
  EXPECT_LT(std::filesystem::file_size(file), 2 * 60'000u);

  KeyframeMap restored(camera);
  restored.restore(read_views(file, test::some_tag(), camera));
  const capture::FrameSet seen = test::textured_view(room, camera, on_arc(0.2), 3);
  const auto before = map.locate(*seen.color), after = restored.locate(*seen.color);
  ASSERT_TRUE(before && after);
  EXPECT_TRUE(after->pose.T_tag_camera.isApprox(before->pose.T_tag_camera, 1e-6));

  const auto reason = [&](const std::filesystem::path& path, const capture::Tag& tag,
                          const capture::CameraModel& model) -> std::string {
    try {
      read_views(path, tag, model);
    } catch (const capture::InputError& e) {
      return e.what();
    }
    return {};
  };
  capture::Tag other = test::some_tag();
  other.id = 5;
  EXPECT_NE(reason(file, other, camera).find("kiosk.views.yml.gz: world: found \"tag36h11 2"), std::string::npos)
      << reason(file, other, camera);
  capture::CameraModel zoomed = camera;
  zoomed.fx = 400;
  EXPECT_NE(reason(file, test::some_tag(), zoomed).find("world: found"), std::string::npos);
  EXPECT_NE(reason(folder / "absent.yml", test::some_tag(), camera), "");

  const std::filesystem::path plain = folder / "views.yml";
  write_views(plain, map.views(), test::some_tag(), camera);
  std::ifstream in(plain, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto damaged = [&](const std::string& content) {
    std::ofstream(plain, std::ios::binary) << content;
    return reason(plain, test::some_tag(), camera);
  };
  EXPECT_EQ(damaged(text), "");
  for (const double part : {0.01, 0.3, 0.6, 0.9, 0.999})
    EXPECT_NE(damaged(text.substr(0, static_cast<std::size_t>(part * static_cast<double>(text.size())))), "") << part;
  std::string version = text;
  version.replace(version.find("format: 1"), 9, "format: 7");
  EXPECT_NE(damaged(version).find("format: found 7, allowed: 1"), std::string::npos) << damaged(version);
  EXPECT_NE(damaged("not a file of views"), "");
  EXPECT_NE(damaged(""), "");
}

TEST(Relocation, AnotherRoomIsNotFound) {
  const capture::CameraModel camera = test::small_camera();
  KeyframeMap map(camera);
  map.add(test::textured_view(large_room(), camera, on_arc(0), 1), {on_arc(0), 1e-8 * PoseCovariance::Identity()});
  TestRoom other = large_room();
  other.boxes = {{{-0.5f, -0.5f, -0.1f}, {0.6f, 0.6f, 0.15f}}};
  Isometry3d elsewhere = on_arc(0.3);
  elsewhere.translation() += Vector3d(1.9, 1.7, 0);
  EXPECT_FALSE(map.locate(*test::textured_view(other, camera, elsewhere, 2).color));
  capture::Frame plain;
  plain.encoded = capture::Image<std::uint8_t>(320, 240, 3, 90);
  EXPECT_FALSE(map.locate(plain));
}

TEST(Relocation, TheWorldOfARoomWithoutATagIsItsFloor) {
  const capture::CameraModel camera = test::small_camera();
  TestRoom room = large_room();
  room.boxes.push_back({{-3, 1.2f, -0.1f}, {3, 1.4f, 3}});  // a wall that is larger in the image than the floor
  for (const double tilt : {35.0, 55.0, 75.0}) {
    const Isometry3d T_room_camera = test::looking_at_tag(1.3, tilt * kDegree, -1.5, {0, 0.4, 0.2});
    const DepthSampler sampler(camera);
    const auto anchor =
        anchored_on_surface(sampler.sample(test::depth_of_room(room, camera, T_room_camera, 5, 1).depth_m));
    ASSERT_TRUE(anchor) << tilt;
    const Isometry3d T_room_world = T_room_camera * anchor->T_tag_camera.inverse();
    const double off_rad = std::acos(std::min(1.0, T_room_world.linear().col(2).z()));
    EXPECT_LT(off_rad, 0.3 * kDegree) << tilt;
    EXPECT_LT(off_rad, 3 * angle_sigma_rad(anchor->covariance)) << tilt;
    EXPECT_LT(std::abs(T_room_world.translation().z()), 0.005) << tilt;
    EXPECT_GT(T_room_world.linear().col(0).dot(T_room_camera.linear().col(0)), 0.9) << "x is the camera's right";
  }
}

TEST(Relocation, WithoutATagTheCameraIsTrackedLostAndFoundAgain) {
  const capture::CameraModel camera = test::small_camera();
  const TestRoom room = large_room();
  capture::Session session;
  session.color.model = camera;
  session.tag.size_m = 0;
  PoseStage stage(session.tag, camera);
  FusionStage fusion(session, {});
  std::shared_ptr<const DistanceField> field;
  Isometry3d T_room_world = Isometry3d::Identity();
  double tracked_mm = 0;
  std::uint64_t index = 0;
  const auto angle_of = [](std::uint64_t i) { return 0.02 * static_cast<double>(i); };  // 35° a second
  for (; index < 24; ++index) {
    const Isometry3d truth = on_arc(angle_of(index));
    const capture::FrameSet frame = test::textured_view(room, camera, truth, index);
    const auto result = stage.locate(frame, field.get());
    ASSERT_TRUE(result.pose) << index;
    EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
    EXPECT_EQ(result.pose->age_ns, 0);
    if (index == 0) T_room_world = truth * result.pose->T_tag_camera.inverse();
    tracked_mm = std::max(tracked_mm, test::millimetres_apart(T_room_world * result.pose->T_tag_camera, truth));
    field = fusion.fuse(frame, *result.pose);
  }
  // Covered for a second, then back at an earlier place.
  int unknown = 0;
  for (; index < 54; ++index) {
    capture::FrameSet covered = test::textured_view(room, camera, on_arc(0.3), 1);
    auto dark = std::make_shared<capture::Frame>();
    dark->encoded = capture::Image<std::uint8_t>(320, 240, 3, 4);
    covered.color = dark;
    covered.depth = nullptr;
    const auto result = stage.locate(at(covered, index), field.get());
    EXPECT_FALSE(result.warnings.empty()) << index;
    unknown += !result.pose;
  }
  EXPECT_GT(unknown, 10);
  const Isometry3d back = on_arc(0.07);
  PoseStage::Result result;
  // All views are compared four times a second.
  for (int i = 0; i < 9 && !result.pose; ++i, ++index)
    result = stage.locate(at(test::textured_view(room, camera, back, 3), index), field.get());
  ASSERT_TRUE(result.pose);
  const double found_mm = test::millimetres_apart(T_room_world * result.pose->T_tag_camera, back);
  std::printf("relocation: without a tag: tracked within %.1f mm, found again within %.1f mm\n", tracked_mm, found_mm);
  EXPECT_LT(tracked_mm, 8);
  EXPECT_LT(found_mm, 8);
}

// Carried through a door with a hand on the lens, into a room that was never seen: the pose is not known there.
TEST(Relocation, InAnotherRoomThePoseIsNotKnown) {
  const capture::CameraModel camera = test::small_camera();
  const TestRoom room = large_room();
  TestRoom other = large_room();
  other.boxes = {{{-0.5f, -0.5f, -0.1f}, {0.6f, 0.6f, 0.15f}}, {{1.0f, -1.0f, -0.1f}, {1.4f, 1.0f, 1.2f}}};
  Isometry3d elsewhere = on_arc(0.3);
  elsewhere.translation() += Vector3d(1.9, 1.7, 0);
  capture::Session session;
  session.color.model = camera;
  session.tag.size_m = 0;
  PoseStage stage(session.tag, camera);
  FusionStage fusion(session, {});
  std::shared_ptr<const DistanceField> field;
  std::uint64_t index = 0;
  for (; index < 15; ++index) {
    const capture::FrameSet frame = test::textured_view(room, camera, on_arc(0.02 * static_cast<double>(index)), index);
    const auto result = stage.locate(frame, field.get());
    ASSERT_TRUE(result.pose) << index;
    field = fusion.fuse(frame, *result.pose);
  }
  auto dark = std::make_shared<capture::Frame>();
  dark->encoded = capture::Image<std::uint8_t>(320, 240, 3, 4);
  for (; index < 45; ++index) {
    capture::FrameSet covered = test::textured_view(room, camera, on_arc(0.3), 1);
    covered.color = dark;
    covered.depth = nullptr;
    stage.locate(at(covered, index), field.get());
  }
  for (; index < 75; ++index) {
    const auto result = stage.locate(at(test::textured_view(other, camera, elsewhere, index), index), field.get());
    EXPECT_FALSE(result.pose) << index;
    ASSERT_FALSE(result.warnings.empty()) << index;
    EXPECT_NE(result.warnings.front().find("camera: lost, neither depth nor earlier views show where it is"),
              std::string::npos)
        << result.warnings.front();
  }
}

// Without a tag, kept views hold the world where it was.
TEST(Relocation, AfterARestartTheWorldIsTheSame) {
  const capture::CameraModel camera = test::small_camera();
  const TestRoom room = large_room();
  capture::Tag none;
  none.size_m = 0;
  PoseStage before(none, camera);
  const auto anchored = before.locate(test::textured_view(room, camera, on_arc(0), 0));
  ASSERT_TRUE(anchored.pose);
  const Isometry3d T_room_world = on_arc(0) * anchored.pose->T_tag_camera.inverse();
  const auto views = before.take_views();
  ASSERT_TRUE(views);
  EXPECT_FALSE(before.take_views()) << "none is new";

  PoseStage after(none, camera);
  after.restore_views(*views);
  const auto found = after.locate(test::textured_view(room, camera, on_arc(0.25), 0));
  ASSERT_TRUE(found.pose);
  EXPECT_LT(test::millimetres_apart(T_room_world * found.pose->T_tag_camera, on_arc(0.25)), 15);
}

// The tag was moved by 40 cm while the service was off: the tag is right, and views that contradict it are dropped.
TEST(Relocation, RestoredViewsThatATagContradictsAreDropped) {
  const capture::CameraModel camera = test::small_camera();
  TestRoom room = large_room();
  room.boxes.clear();
  const Isometry3d T_tag_room(Eigen::Translation3d(0.4, 0, 0));
  const auto above = [](double x_m) -> Isometry3d {
    return Eigen::Translation3d(x_m, 0, 0) * test::looking_at_tag(0.9, 20 * kDegree, -1.2);
  };
  for (const bool moved : {false, true}) {
    KeyframeMap map(camera);
    for (const double x_m : {0.0, 0.2})
      map.add(test::textured_view(room, camera, above(x_m), 0),
              {moved ? T_tag_room * above(x_m) : above(x_m), 1e-8 * PoseCovariance::Identity()});
    PoseStage stage(test::some_tag(), camera);
    stage.restore_views(map.views());
    std::uint64_t index = 0;
    for (; index < 10; ++index) {
      const auto seen = with_tag(test::textured_view(room, camera, above(0), index), camera, above(0));
      ASSERT_TRUE(stage.locate(seen).pose);
    }
    // Out of the tag's view, where only the restored views were.
    PoseStage::Result result;
    for (index = 40; index < 50 && !result.pose; ++index)
      result = stage.locate(test::textured_view(room, camera, above(0.25), index));
    if (result.pose) {
      EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, above(0.25)), 25) << moved;
    }
    EXPECT_TRUE(moved || result.pose);
  }
}

// Depth of a bare floor leaves three directions of the pose open; its texture determines them.
TEST(Relocation, TextureOfABareFloorDeterminesThePose) {
  const capture::CameraModel camera = test::small_camera();
  TestRoom room = large_room();
  room.boxes.clear();
  const DistanceField floor = room.field();
  PoseStage stage(test::some_tag(), camera);
  const Isometry3d above = test::looking_at_tag(0.9, 20 * kDegree, -1.2);
  // The tag is seen once, on the textured floor; then it is taken away.
  const capture::FrameSet first = with_tag(test::textured_view(room, camera, above, 0), camera, above);
  ASSERT_TRUE(stage.locate(first, &floor).pose);
  double worst_mm = 0;
  for (std::uint64_t i = 1; i < 40; ++i) {
    const Isometry3d truth =
        Eigen::Translation3d(0.003 * static_cast<double>(i), 0.002 * static_cast<double>(i), 0) * above;
    const auto result = stage.locate(test::textured_view(room, camera, truth, i), &floor);
    ASSERT_TRUE(result.pose) << i;
    EXPECT_EQ(result.pose->from, Pose::From::surface) << i;
    worst_mm = std::max(worst_mm, test::millimetres_apart(result.pose->T_tag_camera, truth));
  }
  std::printf("relocation: over a bare floor with texture: at most %.1f mm off in %d frames\n", worst_mm, 39);
  EXPECT_LT(worst_mm, 12);
}

}  // namespace
}  // namespace lumigraft::reconstruct
