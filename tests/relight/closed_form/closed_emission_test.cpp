// Objects that emit light, over a floor.
#include <algorithm>
#include <cmath>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr float kRadius_m = 0.1f, kEmission = 4, kEvenSky = 0.2f, kWhite = 0.5f;

/// A black ball that emits, in the middle over a floor under an even sky.
ClosedScene floor_under_ball(float height_m) {
  ClosedScene scene;
  scene.sky = kEvenSky;
  scene.radiance = [albedo = scene.albedo](const Eigen::Vector3f&) { return albedo * kEvenSky; };
  scene.exhibit.objects = {sphere_object(kRadius_m, {0, 0, height_m}, 0)};
  scene.exhibit.objects[0].material.emission = Eigen::Vector3f::Constant(kEmission);
  scene.exhibit.objects[0].white_radiance = kWhite;
  scene.eye_m = {0, -0.9f, 0.9f};
  return scene;
}

/// Of the floor: a sphere above the horizon has the form factor cos · (r / d)², by which it also occludes the sky.
double expected_change(const ClosedScene& scene, const Eigen::Vector3f& p, float height_m) {
  const double d2 = p.head<2>().squaredNorm() + height_m * height_m, cosine = height_m / std::sqrt(d2);
  return scene.albedo * (kWhite * kEmission - kEvenSky) * cosine * kRadius_m * kRadius_m / d2;
}

/// RMS error over the RMS of the expected change, of the floor within `reach_m` of the middle.
double floor_error(const ClosedScene& scene, const relight::RelitPicture& picture, float height_m, float reach_m) {
  double off = 0, all = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v);
      if (picture.maps->mask.at(u, v) > 0 || p.head<2>().cwiseAbs().maxCoeff() > reach_m) continue;
      const double expected = expected_change(scene, p, height_m);
      off += std::pow(picture.maps->delta.at(u, v, 0) - expected, 2);
      all += expected * expected;
    }
  }
  return std::sqrt(off / all);
}

double object_radiance(const ClosedScene& scene, const relight::RelitPicture& picture) {
  return picture_radiance(picture, scene.width / 2, scene.height / 2);
}

TEST(RaysEmission, ABallLightsTheFloorAsItsSolidAngle) {
  struct Case {
    float height_m;
    int trace_scale;
    double bound;
  };
  for (const auto& [height_m, trace_scale, bound] :
       {Case{0.3f, 2, 0.04}, {0.12f, 2, 0.05}, {0.3f, 8, 0.05}, {0.12f, 8, 0.2}}) {
    SCOPED_TRACE(std::to_string(height_m) + " m, 1/" + std::to_string(trace_scale));
    const ClosedScene scene = floor_under_ball(height_m);
    relight::RayRenderer renderer(scene.session());
    const relight::RelitPicture picture = scene.relit(renderer, rays_plan(trace_scale, 20, 1));
    EXPECT_LT(floor_error(scene, picture, height_m, 0.7f), bound);
  }
}

TEST(RaysEmission, TheCameraSeesIt) {
  ClosedScene scene = floor_under_ball(0.3f);
  scene.look_at_m = {0, 0, 0.3f};
  scene.exhibit.objects[0].material.emission = Eigen::Vector3f::Constant(1);
  relight::RayRenderer renderer(scene.session());
  EXPECT_NEAR(object_radiance(scene, scene.relit(renderer, rays_plan())), kWhite, 0.01);
}

// The top of a box under the ball; its probes count rays and patches once.
TEST(RaysEmission, AnObjectLightsAnother) {
  ClosedScene scene = floor_under_ball(0.3f);
  scene.exhibit.objects.push_back(box_object({-0.15f, -0.15f, 0.001f}, {0.15f, 0.15f, 0.02f}, 0.8f));
  scene.exhibit.objects[0].material.emission = Eigen::Vector3f::Constant(2);
  scene.look_at_m = {0.12f, -0.12f, 0.02f};
  relight::RayRenderer renderer(scene.session());
  const relight::RelitPicture picture = scene.relit(renderer, rays_plan(2, 64));
  const Eigen::Vector3f p = scene.on_plane(scene.width / 2, scene.height / 2, 0.02f);
  const double d2 = p.head<2>().squaredNorm() + 0.28 * 0.28, cosine = 0.28 / std::sqrt(d2);
  const double form = cosine * kRadius_m * kRadius_m / d2;
  EXPECT_NEAR(object_radiance(scene, picture), 0.8 * (2 * kWhite * form + kEvenSky * (1 - form)), 0.01);
}

/// A wall 0.3 m high, 4 cm thick, 0.3 m to the right of the middle.
ClosedScene with_wall(ClosedScene scene) {
  const Eigen::AlignedBox3f wall(Eigen::Vector3f(0.3f, -0.5f, -0.1f), Eigen::Vector3f(0.34f, 0.5f, 0.3f));
  scene.extent.max().z() = 0.4f;
  scene.distance = [wall](const Eigen::Vector3f& p) { return std::min(p.z(), box_distance(wall, p)); };
  scene.eye_m = {0.3f, -0.3f, 1.2f};
  scene.look_at_m = {0.4f, 0, 0};
  return scene;
}

/// Mean change over the expected change without the wall, 1 to 10 cm behind it.
double behind_wall(const ClosedScene& scene, const relight::RelitPicture& picture, float height_m) {
  double sum = 0, all = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v);
      if (p.x() < 0.35f || p.x() > 0.44f || std::abs(p.y()) > 0.2f) continue;
      sum += picture.maps->delta.at(u, v, 0);
      all += expected_change(scene, p, height_m);
    }
  }
  EXPECT_GT(all, 0);
  return sum / all;
}

TEST(RaysEmission, RealSurfacesOccludeIt) {
  const ClosedScene scene = with_wall(floor_under_ball(0.12f));
  relight::RayRenderer renderer(scene.session());
  EXPECT_LT(behind_wall(scene, scene.relit(renderer, rays_plan(2, 20, 1)), 0.12f), 0.05);
}

TEST(RaysEmission, APanelEmitsFromItsFront) {
  for (const bool up : {false, true}) {
    ClosedScene scene = floor_under_ball(0.3f);
    relight::VirtualObject& panel = scene.exhibit.objects[0];
    auto model = std::make_shared<relight::Model>();
    const float z = up ? 1.0f : -1.0f;
    for (const auto& corner : {Eigen::Vector2f(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
      model->positions_m.emplace_back(0.1f * corner.x(), 0.1f * z * corner.y(), 0);
      model->normals.emplace_back(0, 0, z);
      model->texcoords.emplace_back(0, 0);
      model->colors.emplace_back(1, 1, 1);
    }
    model->indices = {0, 1, 2, 0, 2, 3};
    relight::Model::Part part;
    part.material = {.base_color = {0, 0, 0}, .specular = 0};
    part.material.emission.setConstant(kEmission);
    part.index_count = 6;
    model->parts = {part};
    panel.model = model;
    panel.material = {};
    relight::RayRenderer renderer(scene.session());
    const relight::RelitPicture picture = scene.relit(renderer, rays_plan(1, 64, 1));
    const int u = scene.width / 2, v = scene.height * 7 / 8;
    const Eigen::Vector3f p = scene.on_plane(u, v);
    const double change = picture.maps->delta.at(u, v, 0);
    // Of a small panel: E = L A cos² / d²; occlusion of the sky likewise.
    const double d2 = p.head<2>().squaredNorm() + 0.09, form = 0.04 * 0.09 / (d2 * d2 * EIGEN_PI);
    const double expected = scene.albedo * form * ((up ? 0 : kWhite * kEmission) - kEvenSky);
    EXPECT_NEAR(change, expected, 0.1 * std::abs(expected) + 0.001) << (up ? "up" : "down");
  }
}

class ClosedEmission : public ClosedTest {};
ON_BOTH_DEVICES(ClosedEmission);

TEST_P(ClosedEmission, ABallLightsTheFloorAsItsSolidAngle) {
  const ClosedScene scene = floor_under_ball(0.3f);
  relight::Plan propagated = careful_plan(64, 1);
  propagated.method = "dlpv";
  for (const auto& [plan, bound] : {std::pair{careful_plan(64, 1), 0.03}, {live_plan(64), 0.05}, {propagated, 0.3}}) {
    SCOPED_TRACE(plan.method + " 1/" + std::to_string(plan.trace_scale));
    EXPECT_LT(floor_error(scene, relit(scene, plan), 0.3f, 0.7f), bound);
  }
}

// Of the materials of a model's parts, as an override of them.
TEST_P(ClosedEmission, TheModelsOwnEmissionIsTheSame) {
  ClosedScene scene = floor_under_ball(0.3f);
  relight::VirtualObject& ball = scene.exhibit.objects[0];
  auto model = std::make_shared<relight::Model>(*ball.model);
  for (relight::Model::Part& part : model->parts) {
    part.material = {.base_color = {0, 0, 0}, .specular = 0};
    part.material.emission = *ball.material.emission;
  }
  ball.model = model;
  ball.material = {};
  EXPECT_LT(floor_error(scene, relit(scene, careful_plan(64, 1)), 0.3f, 0.7f), 0.03);
}

TEST_P(ClosedEmission, TheCameraSeesIt) {
  ClosedScene scene = floor_under_ball(0.3f);
  scene.look_at_m = {0, 0, 0.3f};
  scene.exhibit.objects[0].material.emission = Eigen::Vector3f::Constant(1);
  for (const relight::Plan& plan : {careful_plan(32, 1), live_plan(32)}) {
    EXPECT_NEAR(object_radiance(scene, relit(scene, plan)), kWhite, 0.01) << plan.trace_scale;
  }
}

TEST_P(ClosedEmission, RealSurfacesOccludeIt) {
  const ClosedScene scene = with_wall(floor_under_ball(0.12f));
  EXPECT_NEAR(behind_wall(scene, relit(scene, careful_plan(64, 1)), 0.12f), 0, 0.1);
  // In cells of the outer volume, whose voxels are 3 cm wide: the wall is not much thicker.
  EXPECT_NEAR(behind_wall(scene, relit(scene, live_plan(64)), 0.12f), 0, 0.3);
}

}  // namespace
}  // namespace lumigraft::test
