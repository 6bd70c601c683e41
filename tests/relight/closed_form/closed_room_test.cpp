// Inside a closed room: light that leaves an object arrives at the walls.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "tests/relight/closed_form/cube_room.h"

namespace lumigraft::test {
namespace {

class ClosedRoom : public ClosedTest {};
ON_BOTH_DEVICES(ClosedRoom);

// Energy of injection: nearly black walls receive from a ball under a lamp the reflected flux, and lose the blocked
// flux: over all walls the irradiance grows by ρ Φ and shrinks by Φ = 2π I (1 - cos α), sin α = r/d, the lamp's flux on
// the ball. A convex body does not light itself.
TEST_P(ClosedRoom, WallsReceiveWhatTheBallReflects) {
  constexpr float walls = 0.01f, radius = 0.1f, ball = 0.8f;
  const reconstruct::PointLight lamp = lamp_at({0.12f, -0.2f, 0.28f}, 0.002f, 30);
  CubeRoom room(0.4f, 1.05f * radius);
  room.light_walls(walls, lamp);
  room.exhibit.objects = {sphere_object(radius, {0, 0, 0}, ball)};
  const double sine = radius / lamp.position_m.norm();
  const double sent_W = lamp.intensity.x() * 2 * std::numbers::pi_v<float> * (1 - std::sqrt(1 - sine * sine));
  relight::Relighter relighter(device_, room.session());
  double gained_W = 0, lost_W = 0;
  room.change_on_walls(relighter, careful_plan(64, 1), [&](float W) { (W > 0 ? gained_W : lost_W) += W; });
  EXPECT_NEAR(lost_W, -sent_W, 0.02 * sent_W);          // the shadow, which the ball's own light hardly reaches
  EXPECT_NEAR(gained_W, ball * sent_W, 0.05 * sent_W);  // a wall sees the ball through a dozen cones
}

// A varnish by Schlick with F0 = 0.04 over a Lambert body sends back, of what arrives at the cosine c, F(c) from its
// layer and ρ (1 - F(c)) (1 - F̄) from its body, where F̄ = F0 + (1 - F0) / 21 is the mean over evenly distributed
// directions (Ashikhmin & Shirley 2000): of a lamp's light to a ball ∫ I (F + ρ (1 - F) (1 - F̄)) dω, sin of the
// incidence d/r sin θ; of even light F̄ + ρ (1 - F̄)².
struct Varnish {
  static constexpr double kF0 = 0.04, kEvenly = kF0 + (1 - kF0) / 21;
  double body;

  double albedo(double cosine) const {
    const double f = kF0 + (1 - kF0) * std::pow(1 - cosine, 5);
    return f + body * (1 - f) * (1 - kEvenly);
  }
  double albedo_evenly() const { return kEvenly + body * (1 - kEvenly) * (1 - kEvenly); }
  /// W of a lamp of 1 W/sr that a ball sends back.
  double reflected_W(double radius_m, double distance_m) const {
    constexpr int kSteps = 10000;
    const double ratio = distance_m / radius_m, cap = 1 - std::sqrt(1 - 1 / (ratio * ratio));  // 1 - cos θ
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double below = cap * (i + 0.5) / kSteps, sine2 = ratio * ratio * below * (2 - below);
      sum += albedo(std::sqrt(std::max(1 - sine2, 0.0)));
    }
    return 2 * std::numbers::pi_v<float> * cap * sum / kSteps;
  }
  relight::Material material() const { return {Eigen::Vector3f::Constant(static_cast<float>(body)), 0, 0.2f, 1}; }
};

// What a varnished ball sends on of a lamp's light has passed its layer twice, on both devices as in the reference.
TEST_P(ClosedRoom, WallsReceiveWhatVarnishLetsPass) {
  constexpr float walls = 0.01f, radius = 0.1f;
  const Varnish varnish{0.8};
  const reconstruct::PointLight lamp = lamp_at({0.12f, -0.2f, 0.28f}, 0.002f, 30);
  CubeRoom room(0.4f, 1.05f * radius);
  room.light_walls(walls, lamp);
  room.exhibit.objects = {sphere_object(radius, {0, 0, 0}, 0)};
  room.exhibit.objects[0].material = varnish.material();
  const double wanted_W = lamp.intensity.x() * varnish.reflected_W(radius, lamp.position_m.norm());
  relight::Relighter relighter(device_, room.session());
  double gained_W = 0;
  room.change_on_walls(relighter, careful_plan(64, 1), [&](float W) { gained_W += std::max(W, 0.0f); });
  std::printf("varnish: %.3f of what leaves it of a lamp's light\n", gained_W / wanted_W);
  EXPECT_NEAR(gained_W, wanted_W, 0.05 * wanted_W);  // a wall sees the ball through a dozen cones
}

// Where walls send out L everywhere, a ball of area A that sends the share a of it back takes (1 - a) π L A from nearly
// black walls: a varnished one as much as a matt one of the albedo that the varnish has in even light.
TEST_P(ClosedRoom, WallsMissWhatVarnishTakesOfEvenLight) {
  constexpr float radiance = 0.05f, radius = 0.1f;
  CubeRoom room(0.4f, 1.05f * radius);
  room.albedo = 0.01f;
  room.sky = 0;
  room.radiance = [](const Eigen::Vector3f&) { return radiance; };
  const Varnish varnish{0.8};
  const auto sent_on = [&](const relight::VirtualObject& ball) {
    room.exhibit.objects = {ball};
    relight::Relighter relighter(device_, room.session());
    double sum_W = 0;
    room.change_on_walls(relighter, careful_plan(64, 2), [&](float W) { sum_W += W; });
    return 1 + sum_W / (4 * std::numbers::pi_v<float> * std::numbers::pi_v<float> * radius * radius * radiance);
  };
  relight::VirtualObject ball = sphere_object(radius, {0, 0, 0}, static_cast<float>(varnish.albedo_evenly()));
  const double matt = sent_on(ball);
  ball.material = varnish.material();
  const double varnished = sent_on(ball);
  std::printf("varnish sends on %.3f of even light, a matt ball of its albedo %.3f, wanted %.3f\n", varnished, matt,
              varnish.albedo_evenly());
  EXPECT_NEAR(matt, varnish.albedo_evenly(), 0.04);
  EXPECT_NEAR(varnished, matt, 0.005);
}

// A sealed room holds its own light: where its walls send out L everywhere, a white ball in it sends out L and no wall
// changes, whatever shines outside. Fields know a wall a few voxels deep, cones are wider than that when they meet it,
// and what is left of them sees the sky: of a sky 40 times as bright as the walls 1.4 % gets in, and may not be more.
TEST_P(ClosedRoom, SealedRoomKeepsTheSkyOut) {
  constexpr float radiance = 0.05f, sky = 2;
  CubeRoom scene(0.4f, 0.36f);
  scene.focal_px = 60;
  scene.albedo = 0.8f;
  scene.sky = sky;
  scene.radiance = [](const Eigen::Vector3f&) { return radiance; };
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0}, 1)};
  scene.eye_m = {0.3f, -0.33f, 0.2f};
  scene.look_at_m = {0, 0, 0};
  for (const int volume : {32, 64}) {
    SCOPED_TRACE(volume);
    const relight::RelitPicture picture = relit(scene, careful_plan(volume, 2));
    double max_on_ball = 0, max_on_walls = 0;
    int ball = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        if (picture.maps->mask.at(u, v) == 1) {
          ++ball;
          max_on_ball = std::max(max_on_ball, std::abs(picture_radiance(picture, u, v) - double{radiance}));
        } else {
          max_on_walls = std::max(max_on_walls, std::abs(double{picture.maps->delta.at(u, v)}));
        }
      }
    }
    EXPECT_GT(ball, 200);
    EXPECT_LT(max_on_ball, 0.016 * sky);
    EXPECT_LT(max_on_walls, 0.002 * sky);
  }
}

}  // namespace
}  // namespace lumigraft::test
