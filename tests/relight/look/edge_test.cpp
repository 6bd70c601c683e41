// Sharpness of objects against that of the camera picture: the width of an edge from 10 to 90 % of its step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "reconstruct/pose/pose.h"
#include "relight/compose/soften.h"
#include "relight/look/camera_look.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::test {
namespace {

/// Samples of an edge by their distance from it.
struct EdgeProfile {
  static constexpr double kBinPx = 0.25;
  std::vector<double> sum = std::vector<double>(48), count = sum;

  void add(double distance_px, double value) {
    const auto bin = static_cast<std::ptrdiff_t>(std::floor(distance_px / kBinPx)) + 24;
    if (bin < 0 || bin >= static_cast<std::ptrdiff_t>(sum.size())) return;
    sum[static_cast<std::size_t>(bin)] += value;
    count[static_cast<std::size_t>(bin)] += 1;
  }
  /// Distance at which the profile crosses `level` of the step between its ends, which extend to ±`end_px`.
  double crossing(double level, double end_px) const {
    std::vector<double> x, y;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      const double at = (static_cast<double>(i) + 0.5 - 24) * kBinPx;
      if (count[i] == 0 || std::abs(at) > end_px) continue;
      x.push_back(at);
      y.push_back(sum[i] / count[i]);
    }
    const double low = (y[0] + y[1]) / 2, high = (y.back() + y[y.size() - 2]) / 2;
    for (std::size_t i = 1; i < y.size(); ++i) {
      const double a = (y[i - 1] - low) / (high - low), b = (y[i] - low) / (high - low);
      if (a <= level && b > level) return x[i - 1] + (level - a) / (b - a) * (x[i] - x[i - 1]);
    }
    return NAN;
  }
  double width_px(double end_px) const { return crossing(0.9, end_px) - crossing(0.1, end_px); }
};

/// Of the tag's black square in a picture: one of its sides, away from the corners.
double edge_width_of_tag(const capture::Frame& picture, const capture::CameraModel& camera,
                         const Eigen::Isometry3d& T_tag_camera, double size_m) {
  const auto project = [&](double x, double y) {
    return *camera.project(T_tag_camera.inverse() * Eigen::Vector3d(x, y, 0));
  };
  const Eigen::Vector2d a = project(-size_m / 2, -0.4 * size_m), b = project(-size_m / 2, 0.4 * size_m);
  const Eigen::Vector2d along = (b - a).normalized();
  Eigen::Vector2d out(along.y(), -along.x());
  if (out.dot(project(-size_m, 0) - a) < 0) out = -out;
  const double cell_px = (project(-size_m / 2, 0) - project(-size_m / 2 - size_m / 8, 0)).norm();
  EdgeProfile profile;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector2d off = Eigen::Vector2d(u, v) - a;
      if (off.dot(along) < 0 || off.dot(along) > (b - a).norm()) continue;
      profile.add(off.dot(out), capture::srgb_to_linear(static_cast<float>(picture.encoded.at(u, v, 1)) / 255));
    }
  }
  return profile.width_px(std::min(cell_px - 1, 5.5));
}

/// Of an object with a straight outline at the angle of the tag's side, rendered with 16 × 16 rays per pixel.
double edge_width_of_object(float sigma_px) {
  constexpr int kEdge = 64, kRays = 16;
  const Eigen::Vector2d out(std::cos(0.2), std::sin(0.2));
  relight::ObjectLayer layer{40, 30, capture::Image<float>(kEdge, kEdge, 3), capture::Image<float>(kEdge, kEdge, 1),
                             capture::Image<float>(kEdge, kEdge, 1, 1.0f)};
  const auto distance = [&](double u, double v) { return out.dot(Eigen::Vector2d(u - 72, v - 62)); };
  for (int v = 0; v < kEdge; ++v) {
    for (int u = 0; u < kEdge; ++u) {
      for (int k = 0; k < kRays * kRays; ++k) {
        const double x = 40 + u - 0.5 + (k % kRays + 0.5) / kRays, y = 30 + v - 0.5 + (k / kRays + 0.5) / kRays;
        if (distance(x, y) > 0) layer.coverage.at(u, v) += 1.0f / (kRays * kRays);
      }
    }
  }
  const relight::ObjectLayer soft = relight::softened(layer, sigma_px, 320, 240);
  EdgeProfile profile;
  for (int v = 50; v < 75; ++v) {
    for (int u = 50; u < 95; ++u) profile.add(distance(u, v), soft.coverage.at(u - soft.left, v - soft.top));
  }
  return profile.width_px(5.5);
}

TEST(Edges, OfObjectsAreAsSharpAsTheTags) {
  const capture::CameraModel camera = small_camera();
  const reconstruct::TagFinder finder(some_tag());
  // A sampled Gaussian is no lens below half a pixel.
  for (const double blur_px : {0.0, 0.5, 0.7, 1.0}) {
    reconstruct::PoseStage poses(some_tag(), camera);
    relight::CameraLook look;
    const Eigen::Isometry3d truth = looking_at_tag(0.5, 15 * kDegree, 0.4);
    double of_tag = 0;
    for (unsigned i = 0; i < 5; ++i) {
      capture::Frame picture =
          view_of_tag(camera, finder.pattern(), 0.16, truth, {.code_sigma = 1, .seed = i + 1, .lens_blur = blur_px});
      of_tag = edge_width_of_tag(picture, camera, truth, 0.16);
      capture::FrameSet frame;
      frame.index = i;
      frame.time_ns = i * kFrameNs;
      const auto codes = std::make_shared<const capture::Image<std::uint8_t>>(picture.encoded);
      frame.color = std::make_shared<capture::Frame>(std::move(picture));
      const auto pose = poses.locate(frame).pose;
      ASSERT_TRUE(pose);
      look.follow(codes, camera, pose, nullptr);
    }
    EXPECT_NEAR(edge_width_of_object(look.blur_px()), of_tag, 0.15) << "blur of " << blur_px << " px";
  }
}

TEST(Edges, SofteningKeepsTheObjectsLight) {
  relight::ObjectLayer layer{10, 12, capture::Image<float>(8, 6, 3, 0.5f), capture::Image<float>(8, 6, 1, 1.0f),
                             capture::Image<float>(8, 6, 1, 2.0f)};
  const relight::ObjectLayer soft = relight::softened(layer, 0.8f, 320, 240);
  EXPECT_EQ(soft.left, 7);
  EXPECT_EQ(soft.top, 9);
  double covered = 0, light = 0;
  for (const float value : soft.coverage.data) covered += value;
  for (const float value : soft.radiance.data) light += value;
  EXPECT_NEAR(covered, 48, 0.1);
  EXPECT_NEAR(light, 3 * 0.5 * 48, 0.2);
  EXPECT_EQ(soft.distance_m.at(0, 0), 2) << "what the blur covers has the object's distance";
  EXPECT_EQ(relight::softened(layer, 0, 320, 240).coverage.data, layer.coverage.data);
  // At the image's corner the window does not grow, and the object continues beyond.
  layer.left = layer.top = 0;
  const relight::ObjectLayer corner = relight::softened(layer, 0.8f, 320, 240);
  EXPECT_EQ(corner.left, 0);
  EXPECT_NEAR(corner.coverage.at(0, 0), 1, 1e-5);
}

}  // namespace
}  // namespace lumigraft::test
