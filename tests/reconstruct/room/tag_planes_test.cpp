#include "reconstruct/room/tag_planes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

namespace lumigraft::reconstruct {
namespace {

constexpr double kTag_m = 0.16;
constexpr int kBlock_px = 4;  ///< of an image this wide

capture::Session session_of(bool with_depth_camera) {
  capture::Session session;
  session.color.model = {.width = 320, .height = 240, .fx = 262, .fy = 262, .cx = 159.5, .cy = 119.5};
  session.tag.size_m = kTag_m;
  if (with_depth_camera) session.depth.emplace();
  return session;
}

/// From 0.9 m in front of the tag and 0.5 m above it, looking at it: the horizon is in the image.
Pose pose_above() {
  const Eigen::Vector3d eye(0, -0.9, 0.5), forward = -eye.normalized(), right = Eigen::Vector3d::UnitX();
  Pose pose;
  pose.T_tag_camera.translation() = eye;
  pose.T_tag_camera.linear() << right, forward.cross(right), forward;
  return pose;
}

/// Intersection of a pixel's ray with the plane of a tag, in its frame; empty above the horizon. `z` is the depth
/// there.
std::optional<Eigen::Vector2d> on_plane(const Eigen::Isometry3d& T_plane_camera, const capture::CameraModel& camera,
                                        int u, int v, double& z) {
  const Eigen::Vector3d ray = camera.unproject({u, v}).value();
  const Eigen::Vector3d along = T_plane_camera.linear() * ray, from = T_plane_camera.translation();
  if (along.z() > -1e-6) return std::nullopt;
  z = -from.z() / along.z() * ray.z();
  return (from - from.z() / along.z() * along).head<2>();
}

bool on_box(const Eigen::Vector2d& at) { return std::abs(at.x() - 0.35) < 0.12 && std::abs(at.y() - 0.1) < 0.2; }
bool on_tag(const Eigen::Vector2d& at) { return at.lpNorm<Eigen::Infinity>() < 0.6 * kTag_m; }

/// A grained floor in light that fades with distance, with a tag, a box of another colour and a grey wall behind 1 m.
std::shared_ptr<const capture::Frame> picture_of(const capture::CameraModel& camera, const Eigen::Isometry3d& T) {
  auto frame = std::make_shared<capture::Frame>();
  frame->radiance = capture::Image<float>(camera.width, camera.height, 3);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      double z = 0;
      const auto at = on_plane(T, camera, u, v, z);
      Eigen::Vector3f color(0.2f, 0.25f, 0.3f);
      if (at && at->y() < 1) {
        const auto light = static_cast<float>((1 + 0.1 * std::sin(300 * at->x())) / (1 + at->squaredNorm()));
        color = light * (on_box(*at) ? Eigen::Vector3f(0.5f, 0.1f, 0.1f) : Eigen::Vector3f(0.5f, 0.4f, 0.3f));
        if (on_tag(*at)) color.setConstant(0.05f);
      }
      Eigen::Map<Eigen::Vector3f>(&frame->radiance.at(u, v, 0)) = color;
    }
  return frame;
}

capture::FrameSet frame_at(double time_s, const capture::Session& session) {
  capture::FrameSet frame;
  frame.time_ns = static_cast<std::int64_t>(1e9 * time_s);
  frame.color = picture_of(session.color.model, pose_above().T_tag_camera);
  return frame;
}

/// Whether what is near a pixel, within a block, is all as `test` says.
template <typename Test>
bool all_near(int u, int v, const Test& test) {
  for (const int dv : {-kBlock_px, 0, kBlock_px})
    for (const int du : {-kBlock_px, 0, kBlock_px})
      if (!test(u + du, v + dv)) return false;
  return true;
}

TEST(TagPlanes, DepthIsThatOfTheSurfaceAroundTheTag) {
  const capture::Session session = session_of(false);
  TagPlanes planes(session);
  const capture::FrameSet with = planes.complete(frame_at(0, session), pose_above());
  ASSERT_TRUE(with.depth);
  EXPECT_EQ(planes.warnings().size(), 1u);
  int floor = 0, known = 0, elsewhere = 0;
  const auto place = [&](int u, int v) {
    double z = 0;
    return on_plane(pose_above().T_tag_camera, session.color.model, u, v, z);
  };
  for (int v = kBlock_px; v < 240 - kBlock_px; ++v)
    for (int u = kBlock_px; u < 320 - kBlock_px; ++u) {
      double z = 0;
      const float found = with.depth->depth_m.at(u, v);
      on_plane(pose_above().T_tag_camera, session.color.model, u, v, z);
      if (found > 0) {
        ASSERT_NEAR(found, z, 1e-4) << u << ' ' << v;
      }
      const bool is_floor = all_near(u, v, [&](int x, int y) {
        const auto at = place(x, y);
        return at && at->norm() < 5.5 * kTag_m && !on_box(*at);
      });
      const bool is_other = all_near(u, v, [&](int x, int y) {
        const auto at = place(x, y);
        return !at || at->norm() > 6.5 * kTag_m || at->y() > 1 || on_box(*at);
      });
      floor += is_floor;
      known += is_floor && found > 0;
      if (is_other) {
        ++elsewhere;
        ASSERT_EQ(found, 0) << u << ' ' << v;
      }
    }
  EXPECT_GT(elsewhere, 10'000);
  EXPECT_GT(known, 0.95 * floor);
  EXPECT_GT(floor, 20'000);
}

TEST(TagPlanes, AWallsTagGivesTheWallAndTheNearestCounts) {
  capture::Session session = session_of(false);
  // Upright, 0.3 m behind the first tag, facing the camera.
  Eigen::Isometry3d T_tag_wall = Eigen::Isometry3d::Identity();
  T_tag_wall.linear() << Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitY();
  T_tag_wall.translation() = Eigen::Vector3d(0, 0.3, 0.2);
  session.tag.extra.push_back({7, kTag_m, T_tag_wall});
  TagPlanes planes(session);
  const capture::FrameSet with = planes.complete(frame_at(0, session), pose_above());
  const Eigen::Isometry3d T_camera_tag = pose_above().T_tag_camera.inverse();
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(T_tag_wall.translation()), Eigen::Vector3d(0, -0.2, 0)}) {
    const Eigen::Vector3d in_camera = T_camera_tag * at;
    const Eigen::Vector2d pixel = session.color.model.project(in_camera).value();
    EXPECT_NEAR(with.depth->depth_m.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())), in_camera.z(), 0.005);
  }
}

TEST(TagPlanes, MeasuredDepthIsAwaitedAndCountsAlone) {
  const capture::Session session = session_of(true);
  TagPlanes planes(session);
  EXPECT_FALSE(planes.complete(frame_at(10, session), pose_above()).depth);
  EXPECT_FALSE(planes.complete(frame_at(10.4, session), pose_above()).depth);
  EXPECT_TRUE(planes.warnings().empty());
  EXPECT_TRUE(planes.complete(frame_at(10.6, session), pose_above()).depth);
  EXPECT_EQ(planes.warnings().size(), 1u);
  capture::FrameSet measured = frame_at(10.7, session);
  measured.depth = std::make_shared<capture::DepthFrame>();
  EXPECT_EQ(planes.complete(measured, pose_above()).depth, measured.depth);
  EXPECT_FALSE(planes.complete(frame_at(20, session), pose_above()).depth) << "what was measured stays";
  EXPECT_TRUE(planes.warnings().empty());
}

TEST(TagPlanes, NothingIsKnownWithoutAPoseOfThisFrame) {
  const capture::Session session = session_of(false);
  TagPlanes planes(session);
  Pose old = pose_above();
  old.age_ns = 100'000'000;
  Pose below = pose_above();
  below.T_tag_camera = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()) * below.T_tag_camera;
  EXPECT_FALSE(planes.complete(frame_at(0, session), std::nullopt).depth);
  EXPECT_FALSE(planes.complete(frame_at(0, session), old).depth);
  const auto depth = planes.complete(frame_at(0, session), below).depth;
  EXPECT_EQ(std::count_if(depth->depth_m.data.begin(), depth->depth_m.data.end(), [](float z) { return z > 0; }), 0);
  capture::FrameSet blind = frame_at(0, session);
  blind.color = std::make_shared<capture::Frame>();
  EXPECT_FALSE(planes.complete(blind, pose_above()).depth) << "an image of another size";
}

}  // namespace
}  // namespace lumigraft::reconstruct
