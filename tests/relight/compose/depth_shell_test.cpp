// What a depth camera sees of one side as an occluder.
#include "relight/compose/depth_shell.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test::depth_shell_tests {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr float kFocal_px = 200, kFar_m = 0.7f, kWall_m = 1.2f, kVoxel_m = 0.008f;

/// Depth of something before a wall.
class Seen {
 public:
  Seen() : model_(session_of(kWidth, kHeight, kFocal_px).color.model), rays_(model_) {}

  /// `depth_m(x, y)`: of what is at x, y on the plane z = 1 of the camera; 0: nothing.
  template <typename DepthOf>
  void see(DepthOf depth_of) {
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const Eigen::Vector3f w = rays_.at(u, v);
        const float z = depth_of(w.x() / w.z(), w.y() / w.z());
        const float seen_m = z > 0 ? z : kWall_m;
        depth_m.at(u, v) = seen_m + noise_m * normal_(random_);
        behind_m.at(u, v) = z > 0 ? behind_z_m / w.z() : 0;
      }
    }
  }
  /// Camera frame.
  std::shared_ptr<const relight::Model> shell(int max_vertices = 100000) const {
    const relight::CurrentDepth depth(rays_, &depth_m, kVoxel_m);
    return relight::depth_shell(rays_, Eigen::Isometry3f::Identity(), depth, {0, 0, kWidth, kHeight}, behind_m, nullptr,
                                max_vertices);
  }
  /// Largest z of what moved between two columns of pixels, near the image's middle row.
  static float farthest_m(const relight::Model& model, float from_x, float to_x) {
    float farthest = 0;
    for (const Eigen::Vector3f& p : model.positions_m) {
      const float x = p.x() / p.z();
      if (x > from_x && x < to_x && std::abs(p.y()) < 0.02f && p.z() < kWall_m - 0.1f)
        farthest = std::max(farthest, p.z());
    }
    return farthest;
  }

  capture::Image<float> depth_m{kWidth, kHeight, 1}, behind_m{kWidth, kHeight, 1};
  float noise_m = 0, behind_z_m = kWall_m;

 private:
  capture::CameraModel model_;
  relight::PixelRays rays_;
  std::mt19937 random_{5};
  std::normal_distribution<float> normal_;
};

/// An upright limb with its axis at kFar_m.
float limb(float x, float radius_m) {
  const float off_m = x * kFar_m;
  return std::abs(off_m) < radius_m ? kFar_m - std::sqrt(radius_m * radius_m - off_m * off_m) : 0;
}

TEST(DepthShell, ALimbIsNearlyAsThickAsWide) {
  for (const float radius_m : {0.02f, 0.05f}) {
    Seen seen;
    seen.noise_m = 0.0005f;
    seen.see([&](float x, float) { return limb(x, radius_m); });
    const auto model = seen.shell();
    ASSERT_TRUE(model);
    EXPECT_NEAR(Seen::farthest_m(*model, -0.01f, 0.01f), kFar_m + radius_m, 0.5f * radius_m) << radius_m;
  }
}

TEST(DepthShell, ABoardIsThin) {
  for (const float slope : {0.0f, 0.7f}) {
    Seen seen;
    seen.see([&](float x, float) { return std::abs(x) < 0.15f ? kFar_m / (1 - slope * x) : 0; });
    const auto model = seen.shell();
    ASSERT_TRUE(model);
    EXPECT_LT(Seen::farthest_m(*model, -0.02f, 0.02f), kFar_m / (1 - slope * 0.02f) + 0.015f) << slope;
  }
}

TEST(DepthShell, EndsBeforeWhatIsBehind) {
  Seen seen;
  seen.behind_z_m = kFar_m + 0.02f;  // an object into which the limb would reach
  seen.see([](float x, float) { return limb(x, 0.05f); });
  EXPECT_LT(Seen::farthest_m(*seen.shell(), -0.01f, 0.01f), kFar_m + 0.022f);
}

TEST(DepthShell, FingersOfTwoPixelsRemain) {
  Seen seen;
  seen.see([](float x, float) { return x > 0 && x < 2.0f / kFocal_px ? kFar_m : 0; });
  const auto model = seen.shell();
  float left = 1, right = -1;
  for (const Eigen::Vector3f& p : model->positions_m) {
    if (p.z() > kFar_m + 0.1f) continue;
    left = std::min(left, p.x() / p.z());
    right = std::max(right, p.x() / p.z());
  }
  EXPECT_NEAR((right - left) * kFocal_px, 2, 0.1);
}

TEST(DepthShell, SinglePixelsWithoutDepthAreNoHoles) {
  Seen seen;
  seen.see([](float x, float) { return limb(x, 0.05f); });
  const std::size_t whole = seen.shell()->indices.size();
  seen.depth_m.at(kWidth / 2, kHeight / 2) = 0;
  const auto model = seen.shell();
  EXPECT_EQ(model->indices.size(), whole);
  EXPECT_NEAR(Seen::farthest_m(*model, -0.01f, 0.01f), kFar_m + 0.05f, 0.025f);
}

TEST(DepthShell, UsesFewerVerticesForLargeParts) {
  Seen seen;
  seen.see([](float x, float) { return limb(x, 0.05f); });
  EXPECT_LT(seen.shell(1200)->indices.size(), seen.shell()->indices.size() / 8);
}

}  // namespace
}  // namespace lumigraft::test::depth_shell_tests
