#include "reconstruct/field/distance_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "reconstruct/field/slope_lookup.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// A field filled from a closed-form distance up to `band_m`; other voxels stay unknown.
DistanceField make_field(const std::function<float(const Vector3f&)>& distance_m, const Vector3f& low_m,
                         const Vector3f& high_m, float band_m,
                         const std::function<Vector3f(const Vector3f&)>& radiance = nullptr) {
  DistanceField field;
  field.version = 1;
  const float brick_m = field.voxel_m * kBrickEdge;
  for (int a = std::floor(low_m.x() / brick_m); a <= std::floor(high_m.x() / brick_m); ++a)
    for (int b = std::floor(low_m.y() / brick_m); b <= std::floor(high_m.y() / brick_m); ++b)
      for (int c = std::floor(low_m.z() / brick_m); c <= std::floor(high_m.z() / brick_m); ++c) {
        auto brick = std::make_shared<FieldBrick>();
        BrickColor& color = brick->own_color();
        bool used = false;
        for (int i = 0; i < kBrickVoxels; ++i) {
          const Vector3f p = field.voxel_m * Vector3f(8 * a + i % 8, 8 * b + i / 8 % 8, 8 * c + i / 64);
          const float d = distance_m(p);
          if (std::abs(d) > band_m) continue;
          used = true;
          brick->distance_m[i] = std::clamp(d, -field.truncation_m, field.truncation_m);
          brick->weight[i] = 2;
          if (radiance) {
            color.radiance[i] = radiance(p);
            color.weight[i] = 1;
          }
        }
        if (used) field.bricks[{a, b, c}] = brick;
      }
  return field;
}

float plane(const Vector3f& p) { return p.dot(Vector3f(0.2f, -0.3f, 0.9f).normalized()) - 0.05f; }
float sphere(const Vector3f& p) { return (p - Vector3f(0.1f, -0.2f, 0.3f)).norm() - 0.25f; }

const Vector3f kLow(-0.4f, -0.6f, -0.2f), kHigh(0.5f, 0.4f, 0.7f);

TEST(SlopeLookup, GivesTheSlopesOfTheField) {
  DistanceField field = make_field(sphere, kLow, kHigh, 0.03f);
  auto coarse = std::make_shared<DistanceField>(make_field(plane, 2 * kLow, 2 * kHigh, 0.05f));
  coarse->voxel_m = 2 * field.voxel_m;
  field.coarse = coarse;
  SlopeLookup slope_at(field);
  std::mt19937 random(7);
  // Farther than the bricks that have a place of their own, and all together more of them.
  std::uniform_real_distribution<float> uniform(-0.9f, 1.2f);
  std::normal_distribution<float> noise(0, 0.01f);
  int known = 0;
  for (int i = 0; i < 20'000; ++i) {
    Vector3f p(uniform(random), uniform(random), uniform(random));
    if (i % 2 == 0) p = Vector3f(0.1f, -0.2f, 0.3f) + (0.25f + noise(random)) * p.normalized();
    const auto slow = field.slope(p), fast = slope_at(p);
    ASSERT_EQ(fast.has_value(), slow.has_value()) << i;
    if (!slow) continue;
    ++known;
    EXPECT_NEAR(fast->distance_m, slow->distance_m, 1e-7f);
    EXPECT_LT((fast->gradient - slow->gradient).norm(), 1e-4f);
  }
  EXPECT_GT(known, 8000);
}

TEST(DistanceField, SampleReproducesAPlaneExactly) {
  const DistanceField field = make_field(plane, kLow, kHigh, 0.03f);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-0.15f, 0.15f);
  int known = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3f p(uniform(random), uniform(random), uniform(random));
    const auto sample = field.sample(p);
    if (std::abs(plane(p)) < 0.015f) {
      ASSERT_TRUE(sample);
      ++known;
    }
    if (!sample) continue;
    EXPECT_NEAR(sample->distance_m, plane(p), 1e-6f);
    EXPECT_FLOAT_EQ(sample->weight, 2);
  }
  EXPECT_GT(known, 100);
}

TEST(DistanceField, NothingIsKnownOutsideTheBand) {
  const DistanceField field = make_field(plane, kLow, kHigh, 0.03f);
  const Vector3f n = Vector3f(0.2f, -0.3f, 0.9f).normalized();
  EXPECT_TRUE(field.sample(0.05f * n));
  EXPECT_FALSE(field.sample(0.12f * n));
  EXPECT_FALSE(field.normal(0.12f * n));
  EXPECT_FALSE(field.sample(Vector3f(5, 5, 5)));
  EXPECT_FALSE(field.radiance(Vector3f(5, 5, 5)));
}

TEST(DistanceField, NormalOfASphere) {
  const DistanceField field = make_field(sphere, kLow, kHigh, 0.03f);
  std::mt19937 random(2);
  std::normal_distribution<float> gauss;
  for (int i = 0; i < 500; ++i) {
    const Vector3f n = Vector3f(gauss(random), gauss(random), gauss(random)).normalized();
    const Vector3f p = Vector3f(0.1f, -0.2f, 0.3f) + 0.25f * n;
    const auto normal = field.normal(p);
    ASSERT_TRUE(normal);
    EXPECT_GT(normal->dot(n), std::cos(0.2 * M_PI / 180));
    EXPECT_NEAR(normal->norm(), 1, 1e-5f);
  }
}

TEST(DistanceField, RaycastHitsAPlaneAtTheRightPlace) {
  const DistanceField field = make_field(plane, kLow, kHigh, 0.03f);
  const Vector3f n = Vector3f(0.2f, -0.3f, 0.9f).normalized();
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-0.2f, 0.2f);
  for (int i = 0; i < 500; ++i) {
    const Vector3f from(uniform(random), uniform(random), 0.9f + uniform(random));
    const Vector3f target = 0.05f * n + Vector3f(uniform(random), uniform(random), 0);
    const Vector3f direction = (target - from).normalized();
    const float expected = (0.05f - n.dot(from)) / n.dot(direction);
    const auto hit = field.raycast(from, direction, 0, 3);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance_m, expected, 2e-5f);
    EXPECT_NEAR((hit->position_m - (from + expected * direction)).norm(), 0, 2e-5f);
    EXPECT_GT(hit->normal.dot(n), 1 - 1e-5f);
    EXPECT_FALSE(field.raycast(from, direction, 0, expected - 0.0005f)) << "beyond the far limit";
    EXPECT_TRUE(field.raycast(from, direction, 0, expected + 0.0005f)) << "just within the far limit";
    EXPECT_FALSE(field.raycast(from, direction, expected + 0.01f, 3)) << "starts behind the surface";
  }
}

TEST(DistanceField, RaycastHitsASphereOrMissesIt) {
  const DistanceField field = make_field(sphere, kLow, kHigh, 0.03f);
  const Vector3f centre(0.1f, -0.2f, 0.3f);
  std::mt19937 random(4);
  std::normal_distribution<float> gauss;
  int hits = 0, misses = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3f from = centre + 1.2f * Vector3f(gauss(random), gauss(random), gauss(random)).normalized();
    const Vector3f aim = centre + 0.15f * Vector3f(gauss(random), gauss(random), gauss(random));
    const Vector3f direction = (aim - from).normalized();
    const float along = (centre - from).dot(direction);
    const float aside = (centre - from - along * direction).norm();
    const auto hit = field.raycast(from, direction, 0, 3);
    if (aside > 0.252f) {
      EXPECT_FALSE(hit);
      ++misses;
    } else if (aside < 0.24f) {
      ASSERT_TRUE(hit);
      EXPECT_NEAR(hit->distance_m, along - std::sqrt(0.25f * 0.25f - aside * aside), 4e-4f);
      EXPECT_GT(hit->normal.dot((hit->position_m - centre).normalized()), 0.9999f);
      ++hits;
    }
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(misses, 100);
}

TEST(DistanceField, RaycastFromInsideFindsNoCrossing) {
  const DistanceField field = make_field(sphere, kLow, kHigh, 0.03f);
  EXPECT_FALSE(field.raycast(Vector3f(0.1f, -0.2f, 0.3f), Vector3f::UnitX(), 0, 3));
}

TEST(DistanceField, RaycastAlongAnAxisThroughBrickCorners) {
  const DistanceField field = make_field([](const Vector3f& p) { return p.z(); }, kLow, kHigh, 0.03f);
  for (float x : {0.0f, 0.064f, -0.064f, 0.056f}) {
    const auto hit = field.raycast(Vector3f(x, x, 0.64f), -Vector3f::UnitZ(), 0, 3);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance_m, 0.64f, 1e-5f);
  }
}

TEST(DistanceField, RadianceIsInterpolatedOverSeenVoxels) {
  const auto colour = [](const Vector3f& p) { return Vector3f(1 + p.x(), 2 + p.y(), 3); };
  const DistanceField field = make_field(plane, kLow, kHigh, 0.03f, colour);
  const Vector3f p = 0.05f * Vector3f(0.2f, -0.3f, 0.9f).normalized();
  const auto radiance = field.radiance(p);
  ASSERT_TRUE(radiance);
  EXPECT_NEAR((*radiance - colour(p)).norm(), 0, 1e-5f);
  EXPECT_FALSE(make_field(plane, kLow, kHigh, 0.03f).radiance(p)) << "known, but no colour was seen";
}

}  // namespace
}  // namespace lumigraft::reconstruct
