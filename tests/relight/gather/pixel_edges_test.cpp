// Two adjoining planes as a voxel field represents them: rounded along the edge. Every pixel must get the plane that it
// lies on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "relight/gather/pixel_repair.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr int kWidth = 128, kHeight = 96;
constexpr float kVoxel_m = 0.008f, kRound_m = 1.5f * kVoxel_m;

struct Seen {
  PosedCamera camera;
  capture::Image<float> radiance{kWidth, kHeight, 3};
  std::vector<GBufferPixel> rounded, exact;
  relight::TileMask all() const { return {kWidth, kHeight, true}; }
  std::vector<bool> near_edge;
};

/// View along z from the origin at an edge along y, 0.6 m away; `slope`: slope of the planes on both sides, less than 0
/// for a crease. `moved_px`: offset of the colours' border from the edge.
Seen two_planes(float slope, int moved_px = 0) {
  Seen seen;
  capture::CameraModel& model = seen.camera.model;
  model.width = kWidth;
  model.height = kHeight;
  model.fx = model.fy = 400;
  model.cx = (kWidth - 1) / 2.0;
  model.cy = (kHeight - 1) / 2.0;
  const Vector3f left = Vector3f(-slope, 0, -1).normalized(), right = Vector3f(slope, 0, -1).normalized();
  const Vector3f edge(0, 0, 0.6f);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      GBufferPixel p;
      p.known = true;
      p.w = Vector3f((static_cast<float>(u) - 63.5f) / 400, (static_cast<float>(v) - 47.5f) / 400, 1).normalized();
      const bool on_right = u > 63, appears_right = u > 63 + moved_px;
      const Vector3f& n = on_right ? right : left;
      p.depth_m = n.dot(edge) / n.dot(p.w);
      p.surface.position_m = p.depth_m * p.w;
      p.surface.normal = p.surface.face = n;
      p.albedo.setConstant(appears_right ? 0.8f : 0.4f);
      seen.exact.push_back(p);
      const float x = p.surface.position_m.x(), turned = std::clamp(x / kRound_m, -1.0f, 1.0f);
      p.surface.normal = p.surface.face = ((1 - turned) * left + (1 + turned) * right).normalized();
      const float sunk_m = 0.25f * slope * kRound_m * (1 - std::abs(turned));
      p.depth_m += sunk_m;
      p.surface.position_m = p.depth_m * p.w;
      p.albedo.setConstant(0.6f + 0.2f * turned);  // of what the picture shows, by vertices to both sides
      seen.rounded.push_back(p);
      seen.near_edge.push_back(std::abs(x) < kRound_m);
      for (int c = 0; c < 3; ++c) seen.radiance.at(u, v, c) = appears_right ? 0.5f : 0.25f;
    }
  }
  return seen;
}

class PixelEdges : public testing::TestWithParam<float> {};

TEST_P(PixelEdges, PixelsLieOnOneOfTheIntersectingPlanes) {
  Seen seen = two_planes(GetParam());
  sharpen_edges(seen.camera, seen.radiance, Rgb::Ones(), kVoxel_m, seen.all(), seen.rounded);
  int near = 0;
  for (std::size_t i = 0; i < seen.exact.size(); ++i) {
    const GBufferPixel &is = seen.rounded[i], &wanted = seen.exact[i];
    ASSERT_GT(is.surface.normal.dot(wanted.surface.normal), 0.995f) << "pixel " << i % kWidth << ", " << i / kWidth;
    near += seen.near_edge[i];
    if (!seen.near_edge[i]) continue;
    EXPECT_NEAR(is.albedo[0], wanted.albedo[0], 0.02f) << "pixel " << i % kWidth << ", " << i / kWidth;
    // Above the plane, by little: lamps reach it.
    const float above_m = wanted.surface.normal.dot(is.surface.position_m - wanted.surface.position_m);
    EXPECT_GT(above_m, -0.05f * kVoxel_m);
    EXPECT_LT(above_m, 0.5f * kVoxel_m);
  }
  EXPECT_GT(near, 1000);
}
INSTANTIATE_TEST_SUITE_P(By, PixelEdges, testing::Values(1.2f, 0.8f, -0.8f, -1.2f));

// With small errors of pose or planes, the picture locates the edge better.
TEST(PixelEdges, ColoursSayWhereTheEdgeIs) {
  Seen seen = two_planes(1, 1);
  sharpen_edges(seen.camera, seen.radiance, Rgb::Ones(), kVoxel_m, seen.all(), seen.rounded);
  for (int u = 58; u < 70; ++u) {
    EXPECT_EQ(seen.rounded[48 * kWidth + static_cast<std::size_t>(u)].surface.normal.x() > 0, u > 64) << u;
  }
}

TEST(PixelEdges, RealCurvesStay) {
  Seen seen = two_planes(0);
  constexpr float radius_m = 0.03f;
  const Vector3f middle(0, 0, 0.55f);
  for (GBufferPixel& p : seen.rounded) {
    const float b = p.w.dot(middle), root = b * b - middle.squaredNorm() + radius_m * radius_m;
    p.known = root > 0;
    if (!p.known) continue;
    p.depth_m = b - std::sqrt(root);
    p.surface.position_m = p.depth_m * p.w;
    p.surface.normal = p.surface.face = (p.surface.position_m - middle) / radius_m;
  }
  const std::vector<GBufferPixel> before = seen.rounded;
  sharpen_edges(seen.camera, seen.radiance, Rgb::Ones(), kVoxel_m, seen.all(), seen.rounded);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].known) {
      ASSERT_EQ(seen.rounded[i].surface.normal, before[i].surface.normal) << i;
    }
  }
}

}  // namespace
}  // namespace lumigraft::relight
