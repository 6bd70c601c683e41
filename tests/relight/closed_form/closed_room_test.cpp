// Inside a closed room: what leaves an object arrives at a wall.
#include <cmath>
#include <numbers>

#include "tests/relight/closed_form/cube_room.h"

namespace lumigraft::test {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
class ClosedRoom : public ClosedTest {};
ON_BOTH_DEVICES(ClosedRoom);

// Energy of injection: nearly black walls receive from a ball under a lamp what the ball reflects, and no longer what
// it blocks: over all walls the irradiance grows by ρ Φ and shrinks by Φ = 2π I (1 - cos α), sin α = r/d, what the lamp
// sends to the ball. A convex body lights nothing of itself.
TEST_P(ClosedRoom, WallsReceiveWhatTheBallReflects) {
  constexpr float walls = 0.01f, radius = 0.1f, ball = 0.8f;
  const reconstruct::PointLight lamp = lamp_at({0.12f, -0.2f, 0.28f}, 0.002f, 30);
  CubeRoom room(0.4f, 1.05f * radius);
  room.light_walls(walls, lamp);
  room.exhibit.objects = {sphere_object(radius, {0, 0, 0}, ball)};
  const double sine = radius / lamp.position_m.norm();
  const double sent_W = lamp.intensity.x() * 2 * kPi * (1 - std::sqrt(1 - sine * sine));
  relight::Relighter relighter(device_, room.session());
  double gained_W = 0, lost_W = 0;
  room.change_on_walls(relighter, careful_plan(64, 1), [&](float W) { (W > 0 ? gained_W : lost_W) += W; });
  EXPECT_NEAR(lost_W, -sent_W, 0.02 * sent_W);          // the shadow, which the ball's own light hardly reaches
  EXPECT_NEAR(gained_W, ball * sent_W, 0.05 * sent_W);  // a wall sees the ball through a dozen cones
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
    double most_on_ball = 0, most_on_walls = 0;
    int ball = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        if (picture.maps->mask.at(u, v) == 1) {
          ++ball;
          most_on_ball = std::max(most_on_ball, std::abs(picture_radiance(picture, u, v) - double{radiance}));
        } else {
          most_on_walls = std::max(most_on_walls, std::abs(double{picture.maps->delta.at(u, v)}));
        }
      }
    }
    EXPECT_GT(ball, 200);
    EXPECT_LT(most_on_ball, 0.016 * sky);
    EXPECT_LT(most_on_walls, 0.002 * sky);
  }
}

}  // namespace
}  // namespace lumigraft::test
