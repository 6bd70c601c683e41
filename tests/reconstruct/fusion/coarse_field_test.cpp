// A hall of 12 x 8 x 5 m with columns: what is beyond FusionSettings::far_m is fused in coarser voxels.
#include <gtest/gtest.h>

#include <vector>

#include "reconstruct/field/field_rays.h"
#include "reconstruct/room/enclosure.h"
#include "reconstruct/shading/irradiance.h"
#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using namespace test;

constexpr double kFar_m = 14;  // of the depth camera: the whole hall

double hall(const Vector3d& p) {
  const Vector3d column(std::abs(p.x()) - 2, std::abs(p.y()) - 2, 0);
  return std::min({p.z(), 5 - p.z(), 6 - std::abs(p.x()), 4 - std::abs(p.y()), column.norm() - 0.3});
}

/// Of the far wall at x = 6 m, and of all else.
constexpr double kWallRadiance = 0.4, kRadiance = 0.2;
double hall_radiance(const Vector3d& p) { return p.x() > 5.9 ? kWallRadiance : kRadiance; }

/// At one end of the hall, looking to the other.
Isometry3d at_the_end(double turn_rad) {
  Isometry3d T = Isometry3d::Identity();
  T.linear().col(0) = Vector3d(0, -1, 0);
  T.linear().col(1) = Vector3d(0, 0, -1);
  T.linear().col(2) = Vector3d(1, 0, 0);
  T.prerotate(Eigen::AngleAxisd(turn_rad, Vector3d::UnitZ()));
  T.pretranslate(Vector3d(-5.2, 0.3, 1.6));
  return T;
}

capture::FrameSet hall_frame(const Isometry3d& T, unsigned i, const Shape& shape = hall) {
  return frame_of(shape, small_camera(), T, i, {1, i + 1}, hall_radiance, kFar_m);
}

const DistanceField& fused_hall() {
  static const std::shared_ptr<const DistanceField> field = [] {
    FusionStage stage(session_with(small_camera()), {});
    std::shared_ptr<const DistanceField> fused;
    for (unsigned i = 0; i < 64; ++i) {
      const Isometry3d T = at_the_end(0.3 * std::sin(0.13 * i));
      fused = stage.fuse(hall_frame(T, i), pose_at(T));
    }
    return fused;
  }();
  return *field;
}

/// Distances from the hall of what rays through the image of the middle view hit, between two depths.
struct Hits {
  std::vector<double> away_m;
  int rays = 0;
  double median_m() {
    std::nth_element(away_m.begin(), away_m.begin() + static_cast<std::ptrdiff_t>(away_m.size() / 2), away_m.end());
    return away_m[away_m.size() / 2];
  }
};
Hits hits_in(const DistanceField& field, double from_m, double to_m) {
  const capture::CameraModel camera = small_camera();
  const Isometry3d T = at_the_end(0);
  Hits result;
  for (int v = 8; v < camera.height - 8; v += 5)
    for (int u = 8; u < camera.width - 8; u += 5) {
      const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      const Vector3d direction = (T.linear() * *ray).normalized();
      const auto truth = march(hall, T.translation(), direction, kFar_m);
      if (!truth || *truth < from_m || *truth > to_m ||
          -direction.dot(normal_of(hall, T.translation() + *truth * direction)) < 0.3)
        continue;
      ++result.rays;
      const auto hit = field.raycast(T.translation().cast<float>(), direction.cast<float>(), 0.05f, 14);
      if (hit) result.away_m.push_back(std::abs(hall(hit->position_m.cast<double>())));
    }
  return result;
}

TEST(CoarseField, TheErrorOfTheSurfaceGrowsWithTheVoxels) {
  const DistanceField& field = fused_hall();
  ASSERT_TRUE(field.coarse);
  EXPECT_EQ(field.coarse->voxel_m, kCoarse.voxels * field.voxel_m);
  Hits near = hits_in(field, 1, 4.5), far = hits_in(field, 5.5, 11);
  ASSERT_GT(near.rays, 100);
  ASSERT_GT(far.rays, 100);
  EXPECT_GT(static_cast<double>(near.away_m.size()), 0.97 * near.rays);
  EXPECT_GT(static_cast<double>(far.away_m.size()), 0.95 * far.rays);
  EXPECT_LT(near.median_m(), static_cast<double>(field.voxel_m));
  EXPECT_LT(far.median_m(), static_cast<double>(field.coarse->voxel_m));
}

TEST(CoarseField, RaysEndOnTheFarWallWithItsColour) {
  const DistanceField& field = fused_hall();
  const FieldRays rays(field);
  const Vector3f from(-4, 0, 1);
  int found = 0;
  for (int i = 0; i < 25; ++i) {
    const Vector3f direction =
        Vector3f(10, -1.0f + 0.5f * static_cast<float>(i % 5), 0.4f * static_cast<float>(i / 5)).normalized();
    const auto hit = rays.first_crossing(from, direction, 20);
    ASSERT_TRUE(hit) << i;
    EXPECT_NEAR(hit->x(), 6, 0.2) << i;
    const auto light = field.radiance(*hit);
    if (!light) continue;
    ++found;
    EXPECT_NEAR(light->x(), kWallRadiance, 0.05) << i;
  }
  EXPECT_GT(found, 20);
}

// A patch that faces the length of the hall gathers what its far half sends, of which no other light is known.
TEST(CoarseField, LightIsGatheredFromFarSurface) {
  const DistanceField& field = fused_hall();
  DistanceField near = field;
  near.coarse = nullptr;
  const MetalMask no_metal(session_with(small_camera()));
  const auto gathered = [&](const DistanceField& from) {
    const EnvironmentMap dark{capture::Image<float>(16, 8, 3)};
    const FieldRays rays(from);
    const IrradianceModel model(from, rays, no_metal, nullptr, {Vector3f(0, 0, 1), dark});
    return model.gather(Vector3f(-3, 0, 1.5f), Vector3f::UnitX(), 400).irradiance.x();
  };
  const double with_far = gathered(field), only_near = gathered(near);
  EXPECT_GT(with_far, 1.5 * only_near);
  EXPECT_LT(with_far, M_PI * kWallRadiance);
}

TEST(CoarseField, TheEnclosureReachesTheFarWall) {
  int on_wall = 0, beyond = 0;
  for (const RoomPoint& point : room_points(fused_hall())) {
    on_wall += std::abs(point.position_m.x() - 6) < 0.2f && point.normal.x() < -0.9f ? 1 : 0;
    beyond += point.position_m.x() > 6.3f ? 1 : 0;
  }
  EXPECT_GT(on_wall, 100);
  EXPECT_LT(beyond, on_wall / 20);
}

// Depth of a wall beyond FusionSettings::far_m shows that nobody stands in front of it any more.
TEST(CoarseField, AVisitorBeforeAFarWallIsGoneWithinASecond) {
  const Vector3d middle(-3, 0.3, 1.5);
  const Shape visited = [&](const Vector3d& p) { return std::min(hall(p), (p - middle).norm() - 0.3); };
  const Isometry3d T = at_the_end(0);
  FusionStage stage(session_with(small_camera()), {});
  std::shared_ptr<const DistanceField> field;
  const auto visitor_stands = [&] {
    const Vector3f direction = (middle - T.translation()).normalized().cast<float>();
    return field->raycast(T.translation().cast<float>(), direction, 0.05f, 4).has_value();
  };
  for (unsigned i = 0; i < 8; ++i) field = stage.fuse(hall_frame(T, i, visited), pose_at(T));
  ASSERT_TRUE(visitor_stands());
  for (unsigned i = 8; i < 38; ++i) field = stage.fuse(hall_frame(T, i), pose_at(T));
  EXPECT_FALSE(visitor_stands());
}

TEST(CoarseField, MemoryIsSharedAndBounded) {
  FusionSettings settings;
  settings.max_memory_mb = 80;
  FusionStage stage(session_with(small_camera()), settings);
  std::shared_ptr<const DistanceField> field;
  for (unsigned i = 0; i < 40; ++i) {
    Isometry3d T = at_the_end(0.16 * i);
    T.pretranslate(Vector3d(5.2 * std::min(1.0, 0.05 * i), 0, 0));
    field = stage.fuse(hall_frame(T, i), pose_at(T));
    ASSERT_LE(stage.memory().used_bytes, 1.02e6 * settings.max_memory_mb) << i;
  }
  EXPECT_GT(stage.memory().evicted, 1000u) << "or the hall is too small for this test";
  ASSERT_TRUE(field->coarse);
  EXPECT_GT(field->coarse->bricks.size(), 500u);
}

TEST(CoarseField, ARoomWithinReachHasNone) {
  const Isometry3d T = looking_at_tag(0.85, 50 * kDegree, -1.3);
  FusionStage stage(session_with(small_camera()), {});
  EXPECT_FALSE(stage.fuse(frame_of(ball_on_table, small_camera(), T), pose_at(T))->coarse);
}

/// A brick per cell of 8 voxels of the plane z = height_m, for x from `from_m` to `to_m`.
DistanceField level_surface(float voxel_m, float height_m, float from_m, float to_m) {
  DistanceField field;
  field.voxel_m = voxel_m;
  field.truncation_m = 4 * voxel_m;
  const auto brick_at = [&](float x_m) { return static_cast<int>(std::floor(x_m / (kBrickEdge * voxel_m))); };
  for (int x = brick_at(from_m); x < brick_at(to_m); ++x)
    for (int y = -2; y < 2; ++y)
      for (int z = -1; z < 1; ++z) {
        auto brick = std::make_shared<FieldBrick>();
        for (int i = 0; i < kBrickVoxels; ++i) {
          const auto k = static_cast<std::size_t>(i);
          const float d = voxel_m * static_cast<float>(voxel_in({x, y, z}, i).z()) - height_m;
          brick->distance_m[k] = std::clamp(d, -field.truncation_m, field.truncation_m);
          brick->weight[k] = 1;
        }
        field.bricks[{x, y, z}] = brick;
      }
  return field;
}

TEST(CoarseField, CountsOnlyWhereNothingFinerIsKnown) {
  DistanceField field = level_surface(0.008f, 0, -0.4f, 0);
  field.coarse = std::make_shared<const DistanceField>(level_surface(0.048f, 0.03f, -0.8f, 0.8f));
  const FieldRays rays(field);
  for (const auto& [x, height] : {std::pair{-0.2f, 0.0f}, std::pair{0.3f, 0.03f}}) {
    const Vector3f on(x, 0.01f, height), above(x, 0.01f, 0.3f);
    const auto sample = field.sample(on);
    ASSERT_TRUE(sample) << x;
    EXPECT_NEAR(sample->distance_m, 0, 1e-5) << x;
    ASSERT_TRUE(field.normal(on)) << x;
    EXPECT_NEAR(field.normal(on)->z(), 1, 1e-5) << x;
    ASSERT_TRUE(field.slope(on)) << x;
    EXPECT_NEAR(field.slope(on)->gradient.z(), 1, 1e-4) << x;
    const auto hit = field.raycast(above, -Vector3f::UnitZ(), 0, 1);
    ASSERT_TRUE(hit) << x;
    EXPECT_NEAR(hit->position_m.z(), height, 1e-4) << x;
    const auto crossing = rays.first_crossing(above, -Vector3f::UnitZ(), 1);
    ASSERT_TRUE(crossing) << x;
    EXPECT_NEAR(crossing->z(), height, 1e-4) << x;
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
