// The reference renderer with a reconstructed scene and a camera image.
#include "relight/reference/reference_renderer.h"

#include <cmath>

#include "relight/tracing/build_trace_scene.h"
#include "relight/tracing/trace_scene.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_files.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::test {
namespace {

/// A floor of albedo 0.5 under a uniform sky of radiance 1, with a black ball on it.
ClosedScene ball_on_floor() {
  ClosedScene scene;
  scene.exhibit.objects = {sphere_object(0.15f, {0, 0, 0.15f}, 0)};
  return scene;
}

relight::Plan plan_of(int samples) {
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = samples;
  return plan;
}

relight::RelitPicture relit(relight::ReferenceRenderer& renderer, const ClosedScene& scene, int samples) {
  return renderer.relight(scene.frame(), scene.scene(), scene.exhibit, plan_of(samples), true);
}

TEST(ReferenceRenderer, PutsTheChangeOnTheCameraPicture) {
  const ClosedScene scene = ball_on_floor();
  relight::ReferenceRenderer renderer(scene.session());
  const relight::RelitPicture picture = relit(renderer, scene, 64);
  EXPECT_TRUE(picture.warnings.empty());
  ASSERT_TRUE(picture.maps);
  double worst = 0;
  int floor = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      if (picture.maps->mask.at(u, v) > 0) continue;
      const Eigen::Vector3f p = scene.on_plane(u, v);
      if (!(p.head<2>().cwiseAbs().maxCoeff() < 0.6f && p.head<2>().norm() > 0.2f)) continue;
      // A ball occludes cos · (r / d)² of a uniform sky for a plane that does not intersect it (form factor of a
      // sphere).
      const float d2 = p.head<2>().squaredNorm() + 0.15f * 0.15f, cosine = 0.15f / std::sqrt(d2);
      const float expected = 0.5f - 0.5f * cosine * 0.15f * 0.15f / d2;
      worst = std::max<double>(worst, std::abs(picture_radiance(picture, u, v) - expected));
      EXPECT_NEAR(picture.maps->delta.at(u, v, 0), expected - 0.5f, 0.03);
      ++floor;
    }
  }
  EXPECT_GT(floor, 1000);
  EXPECT_LT(worst, 0.03);
}

TEST(ReferenceRenderer, SameFrameSameBytesWithAndWithoutItsMemory) {
  const ClosedScene scene = ball_on_floor();
  relight::ReferenceRenderer renderer(scene.session()), other(scene.session());
  const reconstruct::Scene known = scene.scene();
  const auto draw = [&](relight::ReferenceRenderer& r) {
    return r.relight(scene.frame(), known, scene.exhibit, plan_of(2)).srgb.data;
  };
  const std::vector<std::uint8_t> first = draw(renderer);
  EXPECT_EQ(first, draw(renderer));
  EXPECT_EQ(first, draw(other));
  ClosedScene moved = scene;
  moved.exhibit.objects[0].position_m.x() += 0.1;
  EXPECT_NE(first, renderer.relight(scene.frame(), known, moved.exhibit, plan_of(2)).srgb.data);
  EXPECT_EQ(first, draw(renderer));
}

TEST(ReferenceRenderer, PassesThroughWhatItCannotDo) {
  ClosedScene scene = ball_on_floor();
  relight::ReferenceRenderer renderer(scene.session());
  reconstruct::Scene unknown = scene.scene();
  unknown.pose.reset();
  const relight::RelitPicture no_pose = renderer.relight(scene.frame(), unknown, scene.exhibit, plan_of(2));
  ASSERT_EQ(no_pose.warnings.size(), 1u);
  EXPECT_NE(no_pose.warnings[0].find("no pose"), std::string::npos);
  EXPECT_NEAR(picture_radiance(no_pose, 48, 60), 0.5f, 0.005f);
  scene.exhibit.objects[0].visible = false;
  EXPECT_NE(relit(renderer, scene, 2).warnings.at(0).find("no visible object"), std::string::npos);
}

TEST(ReferenceRenderer, TakesARoomThatIsKnownFromElsewhere) {
  const ClosedScene scene = ball_on_floor();
  auto room = std::make_shared<relight::ReferenceScene>(relight::reference_room_of(scene.scene(), {}));
  room->background.setZero();
  room->environment.radiance = {};
  relight::ReferenceRenderer dark(scene.session(), [room](const capture::FrameSet&) { return room; });
  const relight::RelitPicture picture = relit(dark, scene, 4);
  for (const float delta : picture.maps->delta.data) ASSERT_EQ(delta, 0) << "there is no light to change";
}

TEST(ReferenceSceneOf, LampsKeepTheirLight) {
  reconstruct::Scene scene = ClosedScene().scene();
  auto light = std::make_shared<reconstruct::Illumination>(*scene.illumination);
  reconstruct::PointLight near = lamp_at({0, 0, 1.3f}, 0.1f, 2), flat = lamp_at({0.6f, 0, 1.1f}, 0.1f, 3), far;
  flat.flat = true;
  flat.direction = (flat.position_m - light->probe_position_m).normalized();
  flat.normal = Eigen::Vector3f(0, 0, -1);
  far.direction = Eigen::Vector3f(0, 0.6f, 0.8f);
  far.irradiance.setConstant(0.7f);
  light->lights = {near, flat, far};
  scene.illumination = light;
  const relight::ReferenceScene room = relight::reference_room_of(scene, {});
  ASSERT_EQ(room.lamps.size(), 3u);
  const auto irradiance_at = [](const relight::ReferenceLamp& lamp, const Eigen::Vector3f& p) {
    const Eigen::Vector3f to = lamp.centre_m - p;
    const float cosine = lamp.shape == relight::ReferenceLamp::Shape::disc ? -lamp.normal.dot(to.normalized()) : 1.0f;
    return lamp.radiance[0] * cosine * 3.14159265f * lamp.radius_m * lamp.radius_m / to.squaredNorm();
  };
  const Eigen::Vector3f probe = light->probe_position_m;
  EXPECT_NEAR(irradiance_at(room.lamps[0], probe), 2, 1e-4f) << "1 m away";
  EXPECT_NEAR(irradiance_at(room.lamps[1], probe), 3, 1e-4f) << "1 m away";
  EXPECT_NEAR(irradiance_at(room.lamps[2], probe), 0.7f, 1e-4f);
  EXPECT_GT((room.lamps[2].centre_m - probe).norm(), 50);
}

TEST(ReferenceSceneOf, AKnownSurfaceTakesThePlaceOfTheFields) {
  const ClosedScene scene;
  relight::Model plate;
  Points corners;
  add_quad(&corners, {-0.2f, -0.2f, 0.002f}, {0.2f, -0.2f, 0.002f}, {0.2f, 0.2f, 0.002f}, {-0.2f, 0.2f, 0.002f});
  add_part(&plate, corners);
  const relight::KnownSurface known{std::make_shared<const relight::Model>(plate),
                                    {Eigen::Vector3f::Constant(0.9f), 1, 0.3f, 1}};
  const relight::ReferenceScene with = relight::reference_room_of(scene.scene(), {known}),
                                without = relight::reference_room_of(scene.scene(), {});
  ASSERT_EQ(with.real.size(), 2u);
  EXPECT_EQ(with.real[1].material.metallic, 1);
  const double gone = 1 - static_cast<double>(with.real[0].model->indices.size()) /
                              static_cast<double>(without.real[0].model->indices.size());
  EXPECT_NEAR(gone, 0.16 / 3.24, 0.01);
  EXPECT_NEAR(without.real[0].model->colors[0].x(), 0.5f, 1e-5f);
}

// A real surface has the material that the session states, whatever its file says.
TEST(ReferenceSceneOf, AKnownSurfaceOfAGltfFileHasNoMaterialOfItsOwn) {
  TemporaryFolder folder;
  GltfFile file;
  file.json["images"] = {{{"uri", "data:image/png;base64," + red_grey_png}}};
  file.json["textures"] = {{{"source", 0}}};
  file.json["materials"] = {{{"normalTexture", {{"index", 0}}}}};
  file.primitive()["material"] = 0;
  capture::RealSurface surface;
  surface.mesh = folder.write("table.gltf", file.gltf());
  surface.specular = 1;
  const auto known = relight::known_surfaces({surface});
  ASSERT_EQ(known.size(), 1u);
  const relight::Model::Part& part = known[0].model->parts.at(0);
  EXPECT_EQ(part.normal_texture.picture, nullptr);
  EXPECT_FALSE(relight::MaterialOverride(known[0].material).over(part.material).gltf);
  EXPECT_EQ(part.index_count, 3u);
}

}  // namespace
}  // namespace lumigraft::test
