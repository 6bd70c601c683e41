// A textured floor under light that falls off, in which the bright part of the texture clips where light is strong.
#include "reconstruct/shading/truncated_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kVoxel_m = 0.01f, kFloor_m = 0.3f * kVoxel_m;

TEST(TruncatedSamples, MeansOfTheOthersAreThoseOfTheTexture) {
  std::mt19937 random(3);
  std::normal_distribution<float> grain(0, 0.2f);
  const auto light = [](float x_m) { return std::exp(-2 * x_m); };
  DistanceField field;
  field.voxel_m = kVoxel_m;
  field.truncation_m = 4 * kVoxel_m;
  for (int a = -8; a < 8; ++a) {
    for (int b = -8; b < 8; ++b) {
      for (int c = -1; c < 1; ++c) {
        const BrickKey key{a, b, c};
        auto brick = std::make_shared<FieldBrick>();
        BrickColor& color = brick->own_color();
        for (int k = 0; k < kBrickVoxels; ++k) {
          const auto i = static_cast<std::size_t>(k);
          const Vector3f p = kVoxel_m * voxel_in(key, k).cast<float>();
          brick->distance_m[i] = std::clamp(p.z() - kFloor_m, -field.truncation_m, field.truncation_m);
          brick->weight[i] = 10;
          if (std::abs(brick->distance_m[i]) >= kVoxel_m) continue;
          const float radiance = light(p.x()) * std::exp(grain(random));
          color.radiance[i] = Vector3f::Constant(std::min(radiance, 1.0f));
          color.weight[i] = radiance > 1 ? -7.0f : 10.0f;
        }
        field.bricks[key] = brick;
      }
    }
  }
  const FieldRays rays(field);
  const MetalMask no_metal(capture::Session{});
  const Surface surface = find_surface(field, rays, no_metal, 1 << 20, 0.04f);
  const std::vector<bool> truncated = truncated_samples(field, surface);
  ASSERT_EQ(truncated.size(), surface.samples.size());
  double kept = 0, sum = 0, sum_of_all = 0;
  for (std::size_t i = 0; i < truncated.size(); ++i) {
    const SurfaceSample& sample = surface.samples[i];
    const double log = std::log(sample.radiance.x() / light(sample.position.x())) - 0.5 * 0.2 * 0.2;
    if (sample.position.x() < 0.2f) sum_of_all += log;
    if (truncated[i]) {
      EXPECT_LT(sample.position.x(), 0.5f) << "where three sigmas do not clip";
      continue;
    }
    EXPECT_GT(sample.position.x(), 0.0f) << "where half clips";
    sum += log;
    ++kept;
  }
  ASSERT_GT(kept, 100);
  EXPECT_LT(std::abs(sum / kept), 0.01);
  EXPECT_LT(sum_of_all / kept, -0.1) << "without that test";
}

}  // namespace
}  // namespace lumigraft::reconstruct
