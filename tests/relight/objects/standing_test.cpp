#include "relight/objects/standing.h"

#include <gtest/gtest.h>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;
using relight::Standing;

/// A table at a height with a step of 5 cm where x > 0.2 m.
std::shared_ptr<const reconstruct::DistanceField> table_at(float height_m, std::uint64_t version = 1) {
  ClosedScene room;
  room.extent = {Vector3f(-0.4f, -0.4f, -0.1f), Vector3f(0.6f, 0.4f, 0.2f)};
  room.distance = [height_m](const Vector3f& p) {
    const Eigen::AlignedBox3f step(Vector3f(0.2f, -1, -1), Vector3f(1, 1, height_m + 0.05f));
    return std::min(p.z() - height_m, box_distance(step, p));
  };
  auto field = std::make_shared<reconstruct::DistanceField>(*room.scene().field);
  field->version = version;
  return field;
}

relight::Exhibit box_at(const Eigen::Vector3d& place_m) {
  relight::Exhibit exhibit;
  exhibit.objects.push_back(box_object(Vector3f(-0.05f, -0.05f, 0), Vector3f(0.05f, 0.05f, 0.1f), 0.5f));
  exhibit.objects[0].position_m = place_m;
  exhibit.objects[0].stands = true;
  return exhibit;
}

double height_of(const relight::Exhibit& exhibit) { return exhibit.objects[0].position_m.z(); }

constexpr double kNear_m = 0.0005;  // of interpolation

TEST(Standing, ObjectsStandOnTheSurfaceBelowThem) {
  const auto field = table_at(0.03f);
  Standing standing;
  const auto placed = [&](const Eigen::Vector3d& place_m) {
    return standing.placed(box_at(place_m), field.get(), Vector3f::UnitZ(), 0);
  };
  EXPECT_NEAR(height_of(placed({0, 0, 0})), 0.03, kNear_m) << "raised";
  EXPECT_NEAR(height_of(placed({0, 0, 0.3})), 0.03, kNear_m) << "lowered";
  EXPECT_NEAR(height_of(placed({0.4, 0, 0})), 0.08, kNear_m) << "on the step";
  EXPECT_NEAR(height_of(placed({0.23, 0, 0})), 0.08, kNear_m) << "more than half on the step";
  EXPECT_NEAR(height_of(placed({0.17, 0, 0})), 0.03, kNear_m) << "less than half on the step";
  EXPECT_EQ(height_of(placed({5, 0, 0.02})), 0.02) << "nothing was seen there";
  EXPECT_EQ(placed({0, 0.1, 0}).objects[0].position_m.y(), 0.1);
}

TEST(Standing, TheLowestPointOfATurnedObjectTouches) {
  const auto field = table_at(0.03f);
  relight::Exhibit exhibit = box_at({0, 0, 0});
  exhibit.objects[0].rotation = Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitX());  // upside down
  EXPECT_NEAR(height_of(Standing().placed(exhibit, field.get(), Vector3f::UnitZ(), 0)), 0.13, kNear_m);
}

TEST(Standing, WhatDoesNotStandStaysAndSoDoesAllWithoutARoom) {
  const auto field = table_at(0.03f);
  relight::Exhibit exhibit = box_at({0, 0, 0.3});
  EXPECT_EQ(height_of(Standing().placed(exhibit, nullptr, Vector3f::UnitZ(), 0)), 0.3);
  exhibit.objects[0].stands = false;
  EXPECT_EQ(height_of(Standing().placed(exhibit, field.get(), Vector3f::UnitZ(), 0)), 0.3);
}

TEST(Standing, NoiseOfTheSurfaceMovesNothingAndAnotherSurfaceDoes) {
  Standing standing;
  const relight::Exhibit exhibit = box_at({0, 0, 0});
  const auto on = [&](float height_m, std::uint64_t version) {
    return height_of(standing.placed(exhibit, table_at(height_m, version).get(), Vector3f::UnitZ(), 0));
  };
  const double first = on(0.03f, 1);
  EXPECT_EQ(on(0.033f, 2), first);
  EXPECT_NEAR(on(0.04f, 3), 0.04, kNear_m) << "a mat was laid below it";
}

TEST(Standing, KeyFramesAreRaisedAlike) {
  const auto field = table_at(0.03f);
  relight::Exhibit exhibit = box_at({0, 0, 0});
  exhibit.objects[0].motion = {{0, {0, 0, 0}, Eigen::Quaterniond::Identity()},
                               {1, {0.4, 0, 0}, Eigen::Quaterniond::Identity()}};
  Standing standing;
  const auto at = [&](double time_s) {
    return standing.placed(exhibit, field.get(), Vector3f::UnitZ(), time_s)
        .objects[0]
        .T_tag_model(time_s)
        .translation();
  };
  EXPECT_NEAR(at(0).z(), 0.03, kNear_m);
  EXPECT_NEAR(at(1).z(), 0.08, kNear_m);
  EXPECT_NEAR(at(1).x(), 0.4, 1e-9);
}

}  // namespace
}  // namespace lumigraft::test
