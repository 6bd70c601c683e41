// The room's change of light, found for one view, as the camera sees it from another pose.
#include "relight/views/reprojected_room.h"

#include <cmath>
#include <numbers>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

constexpr int kSquare_px = 2;
constexpr float kBoard_m = 1, kWall_m = 2;  // depths of two planes; the board is left of x = 0

/// A board before a wall, with a change of light that depends on the place alone.
class ReprojectedRoom : public testing::Test {
 protected:
  ReprojectedRoom() : camera_(session_of(160, 120, 140).color.model), small_(camera_) {
    small_.width /= kSquare_px;
    small_.height /= kSquare_px;
    small_.fx /= kSquare_px;
    small_.fy /= kSquare_px;
    small_.cx = (camera_.cx + 0.5) / kSquare_px - 0.5;
    small_.cy = (camera_.cy + 0.5) / kSquare_px - 0.5;
  }

  static Eigen::Isometry3f pose(float x_m, float turn_deg) {
    Eigen::Isometry3f T = Eigen::Isometry3f::Identity();
    T.translation().x() = x_m;
    T.rotate(Eigen::AngleAxisf(turn_deg * std::numbers::pi_v<float> / 180, Vector3f::UnitY()));
    return T;
  }
  /// Intersection of a ray from there with the board or the wall.
  static Vector3f intersection(const Vector3f& eye_m, const Vector3f& w) {
    const Vector3f on_board = eye_m + (kBoard_m - eye_m.z()) / w.z() * w;
    return on_board.x() < 0 ? on_board : Vector3f(eye_m + (kWall_m - eye_m.z()) / w.z() * w);
  }
  static float change_at(const Vector3f& p_m) {
    return (p_m.z() < 1.5f ? -0.5f : -0.2f) + 0.1f * std::sin(6 * p_m.x()) * std::cos(5 * p_m.y());
  }
  relight::RoomInView seen_from(const Eigen::Isometry3f& T) const {
    relight::RoomInView view;
    view.scale = kSquare_px;
    view.camera = small_;
    view.change = view.radiance = capture::Image<float>(small_.width, small_.height, 3);
    view.tiles = {small_.width, small_.height, true};
    const relight::PixelRays rays(small_);
    for (int v = 0; v < small_.height; ++v) {
      for (int u = 0; u < small_.width; ++u) {
        const Vector3f w = T.linear() * rays.at(u, v), p_m = intersection(T.translation(), w);
        relight::set_at(view.change, view.surfaces.size(), relight::Rgb::Constant(change_at(p_m)));
        relight::set_at(view.radiance, view.surfaces.size(), relight::Rgb::Constant(1));
        view.surfaces.push_back({p_m, -Vector3f::UnitZ(), (p_m - T.translation()).norm(), true, false});
      }
    }
    return view;
  }
  capture::Image<float> depth_from(const Eigen::Isometry3f& T) const {
    capture::Image<float> depth_m(camera_.width, camera_.height, 1);
    const relight::PixelRays rays(camera_);
    for (int v = 0; v < camera_.height; ++v) {
      for (int u = 0; u < camera_.width; ++u) {
        const Vector3f in_camera = T.inverse() * intersection(T.translation(), T.linear() * rays.at(u, v));
        depth_m.at(u, v) = in_camera.z();
      }
    }
    return depth_m;
  }
  /// Fraction of pixels, away from the borders, whose change differs by more than `allowed` from what is there.
  double wrong(const Eigen::Isometry3f& then, const Eigen::Isometry3f& now, const capture::Image<float>* depth_m,
               float allowed) const {
    const relight::PixelRays rays(small_), full_rays(camera_);
    const relight::CurrentDepth depth(full_rays, depth_m, 0.008f);
    const relight::RoomInView found = relight::reprojected(seen_from(then), then, rays, now, depth, nullptr, {});
    const relight::RoomInView true_view = seen_from(now);
    int count = 0, off = 0;
    constexpr int kBorder = 12;
    for (int v = kBorder; v < small_.height - kBorder; ++v) {
      for (int u = kBorder; u < small_.width - kBorder; ++u) {
        const auto i = static_cast<std::size_t>(v * small_.width + u);
        ++count;
        const float error = relight::radiance_at(found.change, i)[0] - relight::radiance_at(true_view.change, i)[0];
        off += found.surfaces[i].known && std::abs(error) < allowed ? 0 : 1;
      }
    }
    return static_cast<double>(off) / count;
  }

  capture::CameraModel camera_, small_;
};

TEST_F(ReprojectedRoom, TheSameViewIsKept) { EXPECT_EQ(wrong(pose(0, 0), pose(0, 0), nullptr, 1e-3f), 0); }

TEST_F(ReprojectedRoom, ACameraThatTurnsSeesTheSameChange) {
  EXPECT_LT(wrong(pose(0, 0), pose(0, 3), nullptr, 0.03f), 0.03)
      << "pixels next to the board's edge are of two surfaces";
}

TEST_F(ReprojectedRoom, PixelsOfTwoSurfacesAreNotMixed) {
  EXPECT_LT(wrong(pose(0, 0), pose(0, 0.41f), nullptr, 0.03f), 0.003) << "by half a pixel: a column is 0.018 of all";
}

TEST_F(ReprojectedRoom, PointsAreOnThePlanesThatTheViewShows) {
  // From 1.2 m above a floor, obliquely; y is downwards.
  Eigen::Isometry3f then = Eigen::Isometry3f::Identity(), now;
  then.rotate(Eigen::AngleAxisf(-0.6f, Vector3f::UnitX()));
  now = then;
  now.translation() = Vector3f(0.1f, -0.05f, 0.1f);
  relight::RoomInView view = seen_from(pose(0, 0));
  const relight::PixelRays rays(small_), full_rays(camera_);
  for (std::size_t i = 0; i < view.surfaces.size(); ++i) {
    const auto u = static_cast<int>(i) % small_.width, v = static_cast<int>(i) / small_.width;
    const Vector3f w = then.linear() * rays.at(u, v), p_m = 1.2f / w.y() * w;
    view.surfaces[i] = {p_m, -Vector3f::UnitY(), p_m.norm(), true, false};
  }
  const relight::CurrentDepth none(full_rays, nullptr, 0.008f);
  const relight::RoomInView found = relight::reprojected(view, then, rays, now, none, nullptr, {});
  for (const relight::ViewSurface& surface : found.surfaces) {
    ASSERT_TRUE(surface.known);
    EXPECT_NEAR(surface.position_m.y(), 1.2f, 1e-3f);
  }
}

TEST_F(ReprojectedRoom, DepthTellsWhichSurfaceIsInFront) {
  // To the right: the board's edge moves 10 pixels over the wall more than the wall itself, and hides what the view
  // saw.
  const Eigen::Isometry3f now = pose(-0.08f, 0);
  const capture::Image<float> depth_m = depth_from(now);
  EXPECT_LT(wrong(pose(0, 0), now, &depth_m, 0.03f), 0.03);
  // To the left: 3 of 56 columns of the wall were hidden. They continue the wall.
  const Eigen::Isometry3f other = pose(0.08f, 0);
  const capture::Image<float> other_depth_m = depth_from(other);
  EXPECT_LT(wrong(pose(0, 0), other, &other_depth_m, 0.03f), 0.08);
}

// A hand has moved in front of the wall. Where it is nothing changes; where it was the wall's change continues.
TEST_F(ReprojectedRoom, WhatCameChangesByNothingAndWhatItUncoversContinues) {
  relight::RoomInView view = seen_from(pose(0, 0));
  capture::Image<float> depth_m = depth_from(pose(0, 0));
  const auto at = [&](int u, int v) { return static_cast<std::size_t>(v * view.camera.width + u); };
  for (int v = 20; v < 30; ++v) {
    for (int u = 50; u < 54; ++u) {  // where a hand was at 0.7 m, which is gone now
      relight::ViewSurface& hand = view.surfaces[at(u, v)];
      hand.position_m *= 0.7f / kWall_m;
      hand.depth_m *= 0.7f / kWall_m;
      relight::set_at(view.change, at(u, v), relight::Rgb::Constant(2));
    }
    for (int u = 60; u < 64; ++u) {  // where it is
      for (int k = 0; k < kSquare_px * kSquare_px; ++k)
        depth_m.at(kSquare_px * u + k % kSquare_px, kSquare_px * v + k / kSquare_px) = 0.7f;
    }
  }
  const relight::PixelRays rays(small_), full_rays(camera_);
  const relight::CurrentDepth depth(full_rays, &depth_m, 0.008f);
  const relight::RoomInView found = relight::reprojected(view, pose(0, 0), rays, pose(0, 0), depth, nullptr, {});
  EXPECT_NEAR(found.change.at(52, 25), change_at(view.surfaces[at(52, 25)].position_m * kWall_m / 0.7f), 0.05f);
  EXPECT_EQ(found.change.at(62, 25), 0);
  EXPECT_FALSE(found.surfaces[at(62, 25)].known);
}

TEST_F(ReprojectedRoom, AChangeIsBoundedWhereTheLightOfNowIsBrighter) {
  relight::RoomInView view = seen_from(pose(0, 0));
  for (float& radiance : view.radiance.data) radiance = 0.1f;  // a shadow, gone since
  const capture::ColorCamera camera = session_of(camera_.width, camera_.height, 140).color;
  auto color = std::make_shared<capture::Frame>();
  color->exposure = 1;
  color->encoded = capture::Image<std::uint8_t>(camera_.width, camera_.height, 3, 200);
  capture::FrameSet frame;
  frame.color = color;
  relight::CameraUpload picture(camera);
  picture.take(frame);
  const relight::PixelRays rays(small_), full_rays(camera_);
  const relight::CurrentDepth none(full_rays, nullptr, 0.008f);
  const relight::RoomInView found = relight::reprojected(view, pose(0, 0), rays, pose(0, 0), none, &picture, {});
  const float now = picture.radiance(0)[0];
  ASSERT_GT(now, 0.3f);
  EXPECT_NEAR(found.change.at(40, 30) / view.change.at(40, 30), 1.5f * 0.1f / now, 1e-3f);
}

TEST_F(ReprojectedRoom, TheOverlapOfViewsIsThatOfTheirImages) {
  const relight::RoomInView view = seen_from(pose(0, 0));
  EXPECT_EQ(relight::overlap(view, pose(0, 0), pose(0, 0)), 1);
  // 160 pixels at a focal length of 140 see 59 degrees.
  EXPECT_NEAR(relight::overlap(view, pose(0, 0), pose(0, 15)), 0.75, 0.08);
  EXPECT_NEAR(relight::overlap(view, pose(0, 0), pose(0, -15)), 0.75, 0.08);
  EXPECT_EQ(relight::overlap(view, pose(0, 0), pose(0, 90)), 0);
}

TEST_F(ReprojectedRoom, WhatWasNotTracedStaysUnknown) {
  relight::RoomInView view = seen_from(pose(0, 0));
  for (std::size_t i = 0; i < view.surfaces.size(); ++i) view.surfaces[i].known = i % view.camera.width < 40;
  const relight::PixelRays rays(small_), full_rays(camera_);
  const relight::CurrentDepth none(full_rays, nullptr, 0.008f);
  const relight::RoomInView found = relight::reprojected(view, pose(0, 0), rays, pose(0, 2), none, nullptr, {});
  EXPECT_TRUE(found.surfaces[30 * view.camera.width + 20].known);
  EXPECT_FALSE(found.surfaces[30 * view.camera.width + 60].known);
  EXPECT_EQ(found.change.at(60, 30), 0);
  EXPECT_FALSE(found.tiles.has(72, 30));
}

}  // namespace
}  // namespace lumigraft::test
