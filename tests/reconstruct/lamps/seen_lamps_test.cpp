// Lamps that are fused as surface.
#include "reconstruct/lamps/seen_lamps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "reconstruct/field/field_rays.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

const Vector3f kFisheye(0, 0, 0.02f);
constexpr float kLampRadiance = 20;
constexpr float kRadius_m = 0.12f;

/// What the cameras saw above the probe: distances and radiance in closed form; negative radiance: clipped at it.
struct Above {
  std::function<float(const Vector3f&)> distance_m;
  std::function<float(const Vector3f&)> radiance;

  std::shared_ptr<const DistanceField> field() const {
    auto field = std::make_shared<DistanceField>();
    field->version = 1;
    for (int a = -6; a < 6; ++a)
      for (int b = -6; b < 6; ++b)
        for (int c = 4; c < 16; ++c) {
          auto brick = std::make_shared<FieldBrick>();
          BrickColor& color = brick->own_color();
          bool any = false;
          for (int i = 0; i < kBrickVoxels; ++i) {
            const Vector3f p = field->voxel_m * voxel_in({a, b, c}, i).cast<float>();
            const float d = distance_m(p);
            if (std::abs(d) > field->truncation_m) continue;
            any = true;
            brick->distance_m[i] = d;
            brick->weight[i] = 1;
            const float shown = radiance(p);
            color.radiance[i] = Vector3f::Constant(std::abs(shown));
            color.weight[i] = shown > 0 ? 1.0f : 0.0f;
          }
          if (any) field->bricks[{a, b, c}] = brick;
        }
    return field;
  }
};

/// As the fish-eye measures it.
std::shared_ptr<Illumination> lamp_at(const Vector3f& centre_m, float radius_m, float radiance = kLampRadiance) {
  auto light = std::make_shared<Illumination>();
  light->probe_position_m = kFisheye;
  PointLight lamp;
  const Vector3f way = centre_m - kFisheye;
  lamp.direction = way.normalized();
  lamp.angular_radius_rad = std::asin(radius_m / way.norm());
  lamp.irradiance = Vector3f::Constant(2 * kTestPi * (1 - std::cos(lamp.angular_radius_rad)) * radiance);
  light->lights.push_back(lamp);
  return light;
}

/// A ceiling at this height with a panel in it.
Above panel_in_ceiling(const Vector3f& centre_m, float panel, float ceiling) {
  return {[=](const Vector3f& p) { return centre_m.z() - p.z(); },
          [=](const Vector3f& p) { return (p - centre_m).head<2>().norm() < kRadius_m ? panel : ceiling; }};
}

TEST(SeenLamps, APanelIsWhereItsSurfaceIs) {
  const Vector3f centre(0.1f, -0.05f, 0.8f);
  for (const float panel : {kLampRadiance, -1.0f}) {
    const auto field = panel_in_ceiling(centre, panel, 0.5f).field();
    const auto light = lamp_at(centre, kRadius_m);
    SeenLamps seen;
    const SeenLamps::Result found = seen.find(*field, light);
    ASSERT_NE(found.surface, nullptr);
    const PointLight& lamp = found.light->lights[0];
    ASSERT_TRUE(lamp.distance_known);
    EXPECT_LT((lamp.position_m - centre).norm(), 0.5f * field->voxel_m);
    EXPECT_TRUE(lamp.flat);
    EXPECT_LT(lamp.normal.z(), -0.999f);
    EXPECT_LT(lamp.distance_log_sigma, 0.02f);
    EXPECT_EQ(seen.find(*field, light).surface, found.surface);

    // Light of the lamp passes, and the ceiling around it is there.
    MaskedField masked;
    const auto without = masked.without(field, found.surface);
    EXPECT_EQ(masked.without(field, found.surface), without);
    EXPECT_NE(without->occluders_version, field->occluders_version);
    const FieldRays rays(*without), before(*field);
    for (const float aside : {-0.9f, 0.0f, 0.9f}) {
      const Vector3f on = centre + Vector3f(aside * kRadius_m, 0, 0.02f);
      EXPECT_TRUE(rays.free({0.3f, 0.2f, 0}, on)) << aside;
      EXPECT_FALSE(before.free({0.3f, 0.2f, 0}, on)) << aside;
    }
    for (const float aside : {-1.3f, 1.3f})
      EXPECT_FALSE(rays.free(kFisheye, centre + Vector3f(0, aside * kRadius_m, 0.02f))) << aside;
  }
}

TEST(SeenLamps, APieceOfAPanelThatNoDepthShowsIsOnThePlaneOfTheOthers) {
  const Vector3f centre(-0.1f, 0, 0.8f), unseen(0.6f, 0, 0.8f);
  const auto field = panel_in_ceiling(centre, kLampRadiance, 0.5f).field();
  auto light = std::make_shared<Illumination>(*lamp_at(centre, kRadius_m));
  light->lights.push_back(lamp_at(unseen, kRadius_m)->lights[0]);
  light->lights[1].id = 1;
  for (PointLight& piece : light->lights) piece.region = 3;
  const SeenLamps::Result found = SeenLamps().find(*field, light);
  ASSERT_TRUE(found.light->lights[1].distance_known);
  EXPECT_LT((found.light->lights[1].position_m - unseen).norm(), field->voxel_m);
}

TEST(SeenLamps, TheCentreOfAGlobeIsBehindItsSurface) {
  const Vector3f centre(-0.1f, 0.1f, 0.7f);
  const Above globe{[=](const Vector3f& p) { return (p - centre).norm() - kRadius_m; },
                    [](const Vector3f&) { return kLampRadiance; }};
  const SeenLamps::Result found = SeenLamps().find(*globe.field(), lamp_at(centre, kRadius_m));
  ASSERT_TRUE(found.light->lights[0].distance_known);
  EXPECT_FALSE(found.light->lights[0].flat);
  EXPECT_LT((found.light->lights[0].position_m - centre).norm(), 0.02f);
}

TEST(SeenLamps, WhatIsBehindALampIsNotTheLamp) {
  const Vector3f bulb(0, 0.1f, 0.5f);
  const auto light = lamp_at(bulb, 0.03f);
  for (const float ceiling : {0.3f * kLampRadiance, -1.0f}) {
    const auto field = panel_in_ceiling({0, 0, 0.8f}, ceiling, ceiling).field();
    const SeenLamps::Result found = SeenLamps().find(*field, light);
    EXPECT_EQ(found.surface, nullptr) << ceiling;
    EXPECT_EQ(found.light, light) << ceiling;
  }
}

TEST(SeenLamps, ACoveredLampStays) {
  const Vector3f centre(0, 0, 0.8f);
  const auto field = panel_in_ceiling(centre, kLampRadiance, 0.5f).field();
  const auto light = lamp_at(centre, kRadius_m);
  SeenLamps seen;
  const SeenLamps::Result before = seen.find(*field, light);
  auto covered = std::make_shared<Illumination>(*light);
  covered->lights[0].covered = true;
  const SeenLamps::Result found = seen.find(*panel_in_ceiling({0, 0, 0.6f}, 0.1f, 0.1f).field(), covered);
  EXPECT_EQ(found.surface, before.surface);
  EXPECT_EQ(found.light->lights[0].position_m, before.light->lights[0].position_m);
}

TEST(SeenLamps, ALampThatIsNoLongerThereIsSurfaceAgain) {
  const Vector3f centre(0, 0, 0.8f);
  const auto field = panel_in_ceiling(centre, kLampRadiance, 0.5f).field();
  SeenLamps seen;
  EXPECT_NE(seen.find(*field, lamp_at(centre, kRadius_m)).surface, nullptr);
  EXPECT_EQ(seen.find(*field, std::make_shared<Illumination>()).surface, nullptr);
}

}  // namespace
}  // namespace lumigraft::reconstruct
