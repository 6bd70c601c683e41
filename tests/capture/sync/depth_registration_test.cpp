#include "capture/sync/depth_registration.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lumigraft::capture {
namespace {

CameraModel pinhole(int width, int height, double f) {
  CameraModel m;
  m.width = width;
  m.height = height;
  m.fx = m.fy = f;
  m.cx = 0.5 * (width - 1);
  m.cy = 0.5 * (height - 1);
  return m;
}

Eigen::Isometry3d true_T_color_depth() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(0.01, Eigen::Vector3d(0.2, 1, 0.1).normalized()).toRotationMatrix();
  T.translation() = Eigen::Vector3d(0.025, 0.001, -0.002);
  return T;
}

/// A plane n·p = d of the colour frame, and a nearer square patch of another one in its middle.
struct Scene {
  Eigen::Vector3d n{0.1, -0.2, 1.0};
  double d = 1.5;
  bool patch = true;

  /// z of the first hit of a ray from `origin`, both in the colour frame, per unit of the ray's parameter.
  double hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray, bool* on_patch = nullptr) const {
    if (patch) {
      const double t = (0.9 - origin.z()) / ray.z();
      const Eigen::Vector3d p = origin + t * ray;
      if (std::abs(p.x()) < 0.15 && std::abs(p.y()) < 0.15) {
        if (on_patch != nullptr) {
          *on_patch = true;
        }
        return t;
      }
    }
    if (on_patch != nullptr) {
      *on_patch = false;
    }
    return (d - n.dot(origin)) / n.dot(ray);
  }
};

constexpr double kUnit = 0.0001;

Image<std::uint16_t> shoot(const Scene& scene, const DepthCamera& camera) {
  Image<std::uint16_t> counts(camera.model.width, camera.model.height, 1);
  for (int v = 0; v < counts.height; ++v) {
    for (int u = 0; u < counts.width; ++u) {
      Eigen::Vector3d ray = *camera.model.unproject({u, v});
      ray /= ray.z();
      const double z = scene.hit(camera.T_color_depth.translation(), camera.T_color_depth.linear() * ray);
      counts.at(u, v) = static_cast<std::uint16_t>(std::lround(z / kUnit));
    }
  }
  return counts;
}

DepthCamera camera(int width, int height, double f) {
  DepthCamera depth;
  depth.registered = false;
  depth.unit_m = kUnit;
  depth.model = pinhole(width, height, f);
  depth.T_color_depth = true_T_color_depth();
  return depth;
}

TEST(DepthRegistration, RegisteredDepthOnlyChangesUnit) {
  DepthCamera depth;
  depth.unit_m = 0.002;
  const DepthRegistration registration(depth, pinhole(2, 1, 100));
  Image<std::uint16_t> counts(2, 1, 1);
  counts.data = {0, 1234};
  EXPECT_EQ(registration(counts).data, (std::vector<float>{0.0f, 2.468f}));
}

TEST(DepthRegistration, TheIdentityChangesNothing) {
  DepthCamera depth = camera(64, 48, 60);
  depth.T_color_depth = Eigen::Isometry3d::Identity();
  const DepthRegistration registration(depth, depth.model);
  const Image<std::uint16_t> counts = shoot({}, depth);
  const Image<float> out = registration(counts);
  for (std::size_t i = 0; i < counts.data.size(); ++i) {
    EXPECT_FLOAT_EQ(out.data[i], static_cast<float>(counts.data[i] * kUnit));
  }
}

/// Against the ray-cast truth: a pixel's depth may be that of a neighbour half a depth pixel away, no further.
void expect_plane(const DepthCamera& depth, const CameraModel& color) {
  Scene scene;
  scene.patch = false;
  const Image<float> out = DepthRegistration(depth, color)(shoot(scene, depth));
  const double pixel = std::max(1.0 / depth.model.fx, 1.0 / color.fx);
  int inside = 0;
  for (int v = 0; v < color.height; ++v) {
    for (int u = 0; u < color.width; ++u) {
      const Eigen::Vector3d ray((u - color.cx) / color.fx, (v - color.cy) / color.fy, 1.0);
      const double truth = scene.hit(Eigen::Vector3d::Zero(), ray);
      const Eigen::Vector3d seen = depth.T_color_depth.inverse() * Eigen::Vector3d(truth * ray);
      const auto at = depth.model.project(seen);
      if (at->x() < 1 || at->y() < 1 || at->x() > depth.model.width - 2 || at->y() > depth.model.height - 2) {
        continue;
      }
      ++inside;
      // Slope of z over the picture: dz/du = z² n_x / (d f).
      const double slope = truth * truth * (std::abs(scene.n.x()) + std::abs(scene.n.y())) / scene.d;
      ASSERT_GT(out.at(u, v), 0.0f) << "hole at " << u << " " << v;
      ASSERT_NEAR(out.at(u, v), truth, slope * pixel * 0.75 + kUnit) << u << " " << v;
    }
  }
  EXPECT_GT(inside, color.width * color.height / 2);
}

TEST(DepthRegistration, APlaneStaysAPlaneWithoutHoles) {
  const CameraModel color = pinhole(160, 120, 130);
  expect_plane(camera(160, 120, 130), color);
  expect_plane(camera(160, 120, 145), color);
  expect_plane(camera(80, 60, 65), color);
  expect_plane(camera(320, 240, 260), color);
  CameraModel bent = color;
  bent.distortion = {0.0, 0.0, 0.0, 0.0, 0.0};
  expect_plane(camera(100, 75, 85), bent);
}

TEST(DepthRegistration, TheNearestWins) {
  const CameraModel color = pinhole(160, 120, 130);
  const DepthCamera depth = camera(160, 120, 130);
  const Scene scene;
  const Image<float> out = DepthRegistration(depth, color)(shoot(scene, depth));
  int wrong = 0;
  int border = 0;
  for (int v = 10; v < color.height - 10; ++v) {
    for (int u = 10; u < color.width - 10; ++u) {
      bool on_patch = false;
      bool near_edge = false;
      for (int dv = -2; dv <= 2; ++dv) {
        for (int du = -2; du <= 2; ++du) {
          bool here = false;
          scene.hit(Eigen::Vector3d::Zero(), {(u + du - color.cx) / color.fx, (v + dv - color.cy) / color.fy, 1.0},
                    &here);
          near_edge = near_edge || ((du != 0 || dv != 0) && here != on_patch && (dv != -2 || du != -2));
          on_patch = (dv == -2 && du == -2) ? here : on_patch;
        }
      }
      if (near_edge) {
        ++border;
        continue;
      }
      const double truth =
          scene.hit(Eigen::Vector3d::Zero(), {(u - color.cx) / color.fx, (v - color.cy) / color.fy, 1.0});
      const float found = out.at(u, v);
      // What only the colour camera sees, behind the patch's edge, stays without depth: unknown is not invented.
      wrong += found != 0.0f && std::abs(found - truth) > 0.02 ? 1 : 0;
      EXPECT_TRUE(!on_patch || std::abs(found - 0.9) < 0.001) << u << " " << v << " " << found;
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(border, 0);
}

TEST(DepthRegistration, WhatTheSensorDidNotMeasureStaysUnknown) {
  const CameraModel color = pinhole(160, 120, 130);
  const DepthCamera depth = camera(160, 120, 130);
  Scene scene;
  scene.patch = false;
  Image<std::uint16_t> counts = shoot(scene, depth);
  int taken = 0;
  for (int v = 5; v < 115; v += 6) {
    for (int u = 5; u < 155; u += 6, ++taken) {
      counts.at(u, v) = 0;
    }
  }
  const Image<float> out = DepthRegistration(depth, color)(counts);
  int holes = 0;
  for (int v = 20; v < 100; ++v) {
    for (int u = 20; u < 140; ++u) {
      holes += out.at(u, v) == 0.0f ? 1 : 0;
    }
  }
  EXPECT_GT(holes, 80 * 120 / 36 * 8 / 10);
}

TEST(DepthRegistration, APointAtTheLensCostsLittleAndBreaksNothing) {
  DepthCamera depth = camera(64, 48, 60);
  depth.T_color_depth.translation().z() = -1.0;
  const Image<std::uint16_t> counts(64, 48, 1, 10001);  // 0.1 mm before the colour camera
  EXPECT_EQ(DepthRegistration(depth, pinhole(64, 48, 60))(counts).data.size(), 64u * 48u);
}

TEST(RegistrationStage, PutsDepthOnTheColourCamerasPixels) {
  Session session;
  session.color.model = pinhole(32, 24, 40);
  session.depth.emplace();
  session.depth->model = pinhole(16, 12, 20);
  session.depth->T_color_depth = true_T_color_depth();
  session.depth->unit_m = kUnit;
  session.depth->registered = false;
  RegistrationStage stage(session);
  FrameSet frame;
  EXPECT_FALSE(stage.register_depth(frame).depth) << "there is none";
  auto raw = std::make_shared<RawDepth>();
  raw->stamp.sequence = 3;
  raw->counts = shoot({}, *session.depth);
  frame.raw_depth = raw;
  const FrameSet registered = stage.register_depth(frame);
  ASSERT_TRUE(registered.depth);
  EXPECT_EQ(registered.depth->stamp.sequence, 3u);
  EXPECT_EQ(registered.depth->depth_m.data, DepthRegistration(*session.depth, session.color.model)(raw->counts).data);
  EXPECT_EQ(stage.register_depth(frame).depth, registered.depth) << "a frame that stands still costs nothing";
  frame.raw_depth = std::make_shared<const RawDepth>(*raw);
  EXPECT_NE(stage.register_depth(frame).depth, registered.depth);
  session.depth.reset();
  EXPECT_FALSE(RegistrationStage(session).register_depth(frame).depth);
}

}  // namespace
}  // namespace lumigraft::capture
