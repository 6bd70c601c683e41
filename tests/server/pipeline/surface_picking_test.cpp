#include "server/pipeline/surface_picking.h"

#include <gtest/gtest.h>

#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::server {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// A floor with a box of 6 cm, seen at 45 degrees from 1 m, and an exhibit that the tag's frame does not level.
class SurfacePicking : public testing::Test {
 protected:
  SurfacePicking() {
    shape.half_m = 0.4f;
    shape.boxes = {{{-0.1f, -0.1f, 0}, {0.1f, 0.1f, 0.06f}}};
    field = shape.field();
    camera.width = 640;
    camera.height = 480;
    camera.fx = camera.fy = 500;
    camera.cx = 319.5;
    camera.cy = 239.5;
    const Vector3d from(0, -0.7, 0.7), axis = (Vector3d(0, 0, 0.06) - from).normalized(), right = Vector3d::UnitX();
    T_tag_camera.linear() << right, axis.cross(right), axis;
    T_tag_camera.translation() = from;
    auto model = std::make_shared<relight::Model>();
    model->positions_m = {{0, 0, -0.03f}, {0.02f, 0, 0.1f}};
    object.model = model;
    object.scale = 2;
  }
  Vector2d pixel_of(const Vector3d& point_m) const { return *camera.project(T_tag_camera.inverse() * point_m); }
  std::variant<Vector3d, std::string> picked(const Vector2d& pixel) const {
    return place_on_picked_surface({T_tag_camera, T_tag_exhibit, &field}, camera, pixel, object);
  }
  std::string refusal(const Vector2d& pixel) const {
    const auto found = picked(pixel);
    const auto* error = std::get_if<std::string>(&found);
    return error ? *error : "";
  }

  reconstruct::TestRoom shape;
  reconstruct::DistanceField field;
  capture::CameraModel camera;
  Isometry3d T_tag_camera = Isometry3d::Identity(), T_tag_exhibit = Isometry3d::Identity();
  relight::VirtualObject object;
};

TEST_F(SurfacePicking, IsWhereTheLowestPointStandsOnTheSurface) {
  for (const Vector3d& surface : {Vector3d(0.04, 0.02, 0.06), Vector3d(0.25, -0.1, 0)}) {
    const auto found = picked(pixel_of(surface));
    const auto* place_m = std::get_if<Vector3d>(&found);
    ASSERT_TRUE(place_m) << std::get<std::string>(found);
    EXPECT_LT((*place_m - (surface + Vector3d(0, 0, 2 * 0.03))).norm(), 1e-3);
  }
  // Turned upside down the other point is the lowest.
  object.rotation = Eigen::AngleAxisd(M_PI, Vector3d::UnitX());
  const auto found = picked(pixel_of({0, 0, 0.06}));
  EXPECT_LT((std::get<Vector3d>(found) - Vector3d(0, 0, 0.06 + 2 * 0.1)).norm(), 1e-3);
}

TEST_F(SurfacePicking, IsInTheExhibitsFrame) {
  T_tag_exhibit = Eigen::Translation3d(0.1, -0.2, 0.05) * Eigen::AngleAxisd(0.7, Vector3d::UnitZ());
  const auto found = picked(pixel_of({0.02, 0.03, 0.06}));
  EXPECT_LT((T_tag_exhibit * std::get<Vector3d>(found) - Vector3d(0.02, 0.03, 0.06 + 2 * 0.03)).norm(), 1e-3);
}

TEST_F(SurfacePicking, RefusesWallsTheUnknownAndPixelsOutside) {
  EXPECT_NE(refusal(pixel_of({0, -0.1, 0.03})).find("found a wall or a slope"), std::string::npos);
  EXPECT_NE(refusal(pixel_of({0, 0.9, 0})).find("found no known surface"), std::string::npos);
  EXPECT_NE(refusal({640, 100}).find("found 640, 100, allowed: a pixel of the picture, 640 x 480"), std::string::npos);
}

}  // namespace
}  // namespace lumigraft::server
