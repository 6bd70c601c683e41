// Transmissive objects in rooms with closed forms.
#include <cmath>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/cube_room.h"

namespace lumigraft::test {
namespace {

/// Reflectance of the index 1.5 (Fresnel).
double mirrored_at(double angle) {
  if (angle < 1e-9) return 0.04;
  const double inside = std::asin(std::sin(angle) / 1.5);
  const double s = std::sin(angle - inside) / std::sin(angle + inside),
               p = std::tan(angle - inside) / std::tan(angle + inside);
  return (s * s + p * p) / 2;
}

relight::Material clear_glass() {
  relight::Material material{.base_color = {1, 1, 1}, .roughness = 0};
  material.transmission = 1;
  return material;
}

/// Nearly black walls around a ball under a lamp.
struct BallInCube : CubeRoom {
  static constexpr float kRadius_m = 0.1f;
  const reconstruct::PointLight lamp = lamp_at({0.12f, -0.2f, 0.28f}, 0.002f, 30);

  explicit BallInCube(const relight::Material& material) : CubeRoom(0.4f, 1.05f * kRadius_m) {
    light_walls(0.01f, lamp);
    exhibit.objects = {sphere_object(kRadius_m, {0, 0, 0}, 0)};
    exhibit.objects[0].material = material;
  }
  /// That the lamp sends to the ball: 2π I (1 - cos α), sin α = r / d.
  double sent_W() const {
    const double sine = kRadius_m / lamp.position_m.norm();
    return lamp.intensity.x() * 2 * std::numbers::pi * (1 - std::sqrt(1 - sine * sine));
  }
  /// Change of what the walls receive, of the lamp's light to the ball.
  double change_share(relight::Renderer& renderer, const relight::Plan& plan) {
    double sum_W = 0;
    change_on_walls(renderer, plan, [&](float W) { sum_W += static_cast<double>(W); });
    return sum_W / sent_W();
  }
};

// All light that a ball without absorption takes from the walls it sends to other places on them.
TEST(RaysGlass, WallsReceiveWhatALosslessBallTakesFromThem) {
  for (const int trace_scale : {1, 4}) {
    BallInCube room(clear_glass());
    relight::RayRenderer renderer(room.session());
    EXPECT_NEAR(room.change_share(renderer, rays_plan(trace_scale, 64)), 0, 0.05) << trace_scale;
  }
}

// A path of the mean chord, 4/3 of the radius, leaves half.
TEST(RaysGlass, AbsorptionIsLostToTheWalls) {
  relight::Material material = clear_glass();
  material.attenuation_color.setConstant(0.25f);
  material.attenuation_distance_m = 8.0f / 3 * BallInCube::kRadius_m;
  BallInCube room(material);
  relight::RayRenderer renderer(room.session());
  const double change = room.change_share(renderer, rays_plan(1, 64));
  // What enters is refracted towards the axis: its chords, 2 r cos of the refracted angle, are longer than the mean.
  constexpr int kSteps = 1000;
  double passed = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double h2 = (k + 0.5) / kSteps, chord_r = 2 * std::sqrt(1 - h2 / 2.25);
    const double r = mirrored_at(std::asin(std::sqrt(h2))), left = std::pow(0.5, chord_r * 3 / 4);
    passed += (r + (1 - r) * (1 - r) * left / (1 - r * left)) / kSteps;  // all that leaves, by how often reflected
  }
  EXPECT_NEAR(change, passed - 1, 0.04);
}

ClosedScene ball_in_even_light(float roughness) {
  ClosedScene scene;
  scene.radiance = [](const Eigen::Vector3f&) { return 1.0f; };
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.15f}, 0)};
  relight::Material material = clear_glass();
  material.roughness = roughness;
  scene.exhibit.objects[0].material = material;
  scene.look_at_m = {0, 0, 0.15f};
  return scene;
}

/// Means over the pixels of the object and over the floor near it.
struct EvenLight {
  double object = 0, change = 0;

  EvenLight(const ClosedScene& scene, const relight::RelitPicture& picture) {
    int inside = 0, outside = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        if (picture.maps->mask.at(u, v) == 1) {
          object += static_cast<double>(picture_radiance(picture, u, v));
          ++inside;
        } else if (picture.maps->mask.at(u, v) == 0 && scene.on_plane(u, v).head<2>().norm() < 0.4f) {
          change += static_cast<double>(picture.maps->delta.at(u, v));
          ++outside;
        }
      }
    }
    EXPECT_GT(inside, 50);
    EXPECT_GT(outside, 50);
    object /= inside;
    change /= outside;
  }
};

/// A tinted ball of which a part of the light under its layer passes: by its texture, or by a factor alone.
ClosedScene half_transmissive(bool textured) {
  ClosedScene scene = ball_in_even_light(0);
  relight::VirtualObject& ball = scene.exhibit.objects[0];
  auto model = std::make_shared<relight::Model>(*ball.model);
  for (relight::Model::Part& part : model->parts) {
    part.material = clear_glass();
    part.material.base_color = {0.8f, 0.4f, 0.2f};
    part.material.transmission = 102.0f / 255;
    if (!textured) continue;
    part.transmission_factor = 0.8f;
    auto red = std::make_shared<capture::Image<std::uint8_t>>(2, 2, 3);
    for (std::size_t i = 0; i < red->data.size(); i += 3) red->data[i] = 255 / 2 + 1;  // 0.8 of it is 102.4
    part.transmission_texture.picture = red;
  }
  ball.model = model;
  ball.material = {};
  return scene;
}

void expect_alike(const relight::RelitPicture& a, const relight::RelitPicture& b) {
  for (std::size_t i = 0; i < a.srgb.data.size(); ++i) ASSERT_NEAR(a.srgb.data[i], b.srgb.data[i], 1) << i;
}

TEST(RaysGlass, ATextureOfTransmissionMultipliesIt) {
  const ClosedScene textured = half_transmissive(true), plain = half_transmissive(false);
  relight::RayRenderer renderer(textured.session()), other(plain.session());
  const relight::RelitPicture picture = textured.relit(renderer, rays_plan(2));
  expect_alike(picture, plain.relit(other, rays_plan(2)));
  const std::size_t at = picture.srgb.index(textured.width / 2, textured.height / 2);
  EXPECT_GT(picture.srgb.data[at], picture.srgb.data[at + 2] + 20) << "it is tinted";
}

// Even light from everywhere passes a ball unchanged, to the camera and to the floor, where a black ball takes a tenth
// of the light.
TEST(RaysGlass, ALosslessBallInEvenLightIsInvisible) {
  for (const float roughness : {0.0f, 0.2f}) {
    const ClosedScene scene = ball_in_even_light(roughness);
    relight::RayRenderer renderer(scene.session());
    const relight::RelitPicture picture = scene.relit(renderer, rays_plan(1, 64));
    EXPECT_TRUE(picture.warnings.empty());
    const EvenLight found(scene, picture);
    EXPECT_NEAR(found.object, 1, roughness > 0 ? 0.05 : 0.03) << roughness;  // rough interfaces lose some light
    EXPECT_NEAR(found.change, 0, 0.01) << roughness;
  }
}

// Through a thick plate the floor is seen where Snell's angle leads, as the camera's picture shows it.
TEST(RaysGlass, APlateShowsTheFloorBehindIt) {
  constexpr float kTop_m = 0.1f;
  ClosedScene scene;
  scene.sky = 0;
  scene.albedo = 0.01f;  // what the plate reflects to the floor is not seen
  scene.radiance = [](const Eigen::Vector3f& p) { return 0.4f + p.y(); };
  scene.exhibit.objects = {box_object({-0.3f, -0.3f, 0.001f}, {0.3f, 0.3f, kTop_m}, 0)};
  scene.exhibit.objects[0].material = clear_glass();
  scene.look_at_m = {0, 0, kTop_m};
  relight::RayRenderer renderer(scene.session());
  const relight::RelitPicture picture = scene.relit(renderer, rays_plan(1, 16));
  double shown = 0, expected = 0;
  for (const int v : {30, 36, 42}) {
    for (int u = 40; u < 56; ++u) {
      const Eigen::Vector3f top = scene.on_plane(u, v, kTop_m), w = (top - scene.eye_m).normalized();
      const double angle = std::acos(-static_cast<double>(w.z())), inside = std::asin(std::sin(angle) / 1.5);
      const double y_m =
          static_cast<double>(top.y()) + static_cast<double>(kTop_m * w.y() / w.head<2>().norm()) * std::tan(inside);
      const double r = mirrored_at(angle);
      shown += static_cast<double>(picture_radiance(picture, u, v));
      expected += (0.4 + y_m) * (1 - r) / (1 + r);
    }
  }
  EXPECT_NEAR(shown, expected, 0.02 * expected);
}

// The shadow of a coloured sheet has the sheet's colour.
TEST(RaysGlass, ASheetCastsAColouredShadow) {
  ClosedScene scene;
  scene.sky = 0;
  scene.albedo = 0.02f;  // as above
  scene.lamps = {lamp_at({0, 0, 0.8f}, 0.01f, 30)};
  scene.radiance = [lamp = scene.lamps[0], albedo = scene.albedo](const Eigen::Vector3f& p) {
    return albedo / std::numbers::pi_v<float> * irradiance(lamp, p, Eigen::Vector3f::UnitZ());
  };
  scene.exhibit.objects = {box_object({-0.1f, -0.1f, 0.2f}, {0.1f, 0.1f, 0.2001f}, 0)};
  relight::Material material = clear_glass();
  material.thin_walled = true;
  material.base_color = {0.8f, 0.5f, 0.2f};  // of each of its two sides
  scene.exhibit.objects[0].material = material;
  scene.eye_m = {0, -0.9f, 0.15f};
  relight::RayRenderer renderer(scene.session());
  const relight::RelitPicture picture = scene.relit(renderer, rays_plan(1, 16));
  Eigen::Array3d change = Eigen::Array3d::Zero();
  double all = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v);
      if (picture.maps->mask.at(u, v) > 0 || p.head<2>().cwiseAbs().maxCoeff() > 0.09f) continue;
      for (int c = 0; c < 3; ++c) change[c] += static_cast<double>(picture.maps->delta.at(u, v, c));
      all += static_cast<double>(scene.radiance(p));
    }
  }
  ASSERT_GT(all, 0);
  for (int c = 0; c < 3; ++c) {
    const double once = static_cast<double>(material.base_color[c]) * (1 - mirrored_at(0));
    EXPECT_NEAR(change[c] / all, once * once - 1, 0.03) << c;
  }
}

class ClosedGlass : public ClosedTest {};
ON_BOTH_DEVICES(ClosedGlass);

TEST_P(ClosedGlass, ALosslessBallInEvenLightIsInvisible) {
  const ClosedScene scene = ball_in_even_light(0);
  for (const relight::Plan& plan : {careful_plan(64, 1), live_plan(64)}) {
    const relight::RelitPicture picture = relit(scene, plan);
    ASSERT_EQ(picture.warnings.size(), 1u);
    EXPECT_NE(picture.warnings[0].find("\"object\" is transmissive"), std::string::npos) << picture.warnings[0];
    const EvenLight found(scene, picture);
    EXPECT_NEAR(found.object, 1, 0.1) << plan.trace_scale;
    EXPECT_NEAR(found.change, 0, 0.02) << plan.trace_scale;
  }
}

TEST_P(ClosedGlass, ATextureOfTransmissionMultipliesIt) {
  const relight::Plan plan = careful_plan(32, 1);
  expect_alike(relit(half_transmissive(true), plan), relit(half_transmissive(false), plan));
}

// The ball's shadow is the light that it reflects, which arrives elsewhere.
TEST_P(ClosedGlass, ShadowsKeepWhatPasses) {
  BallInCube room(clear_glass());
  relight::Relighter relighter(device_, room.session());
  EXPECT_NEAR(room.change_share(relighter, careful_plan(64, 1)), 0, 0.06);
}

// An object's index and absorption reach its pixels: a ball that is black but for red light.
TEST_P(ClosedGlass, AbsorptionColoursWhatIsSeen) {
  ClosedScene scene = ball_in_even_light(0);
  scene.exhibit.objects[0].material.attenuation_color = Eigen::Vector3f(1, 0, 0);
  scene.exhibit.objects[0].material.attenuation_distance_m = 0.01f;
  const relight::RelitPicture picture = relit(scene, careful_plan(64, 1));
  const std::size_t at = picture.srgb.index(scene.width / 2, scene.height / 2);
  EXPECT_GT(picture.srgb.data[at], 2 * picture.srgb.data[at + 1]);
  EXPECT_NEAR(static_cast<double>(picture_radiance(picture, scene.width / 2, scene.height / 2)), 1, 0.1);
}

}  // namespace
}  // namespace lumigraft::test
