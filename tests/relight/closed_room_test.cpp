// Inside a closed room: what leaves an object arrives at a wall.
#include <cmath>
#include <numbers>

#include "closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kHalfRoom_m = 0.4f;

/// A cube of 0.8 m around the origin with walls of the given thickness, seen from `from_m` before its middle.
ClosedScene cube_room(float wall_m, float from_m) {
  ClosedScene scene;
  scene.width = scene.height = 40;
  scene.focal_px = 0.5 * scene.width * (kHalfRoom_m - from_m) / kHalfRoom_m;  // a wall fills the picture to its border
  scene.distance = [wall_m](const Eigen::Vector3f& p) {
    const float half_m = 0.5f * wall_m, beyond_m = box_distance({Eigen::Vector3f::Constant(-kHalfRoom_m - half_m),
                                                                 Eigen::Vector3f::Constant(kHalfRoom_m + half_m)},
                                                                p);
    return std::abs(beyond_m) - half_m;
  };
  const Eigen::Vector3f outside = Eigen::Vector3f::Constant(kHalfRoom_m + wall_m + 0.04f);
  scene.extent = {-outside, outside};
  return scene;
}

void look_along(ClosedScene& scene, int wall, float from_m) {
  Eigen::Vector3f axis = Eigen::Vector3f::Zero();
  axis[wall / 2] = wall % 2 ? -1.0f : 1.0f;
  scene.eye_m = from_m * axis;
  scene.look_at_m = axis;
}

class ClosedRoom : public ClosedTest {};
ON_BOTH_DEVICES(ClosedRoom);

// Energy of injection: nearly black walls receive from a ball under a lamp what the ball reflects, and no longer what
// it blocks: over all walls the irradiance grows by ρ Φ and shrinks by Φ = 2π I (1 - cos α), sin α = r/d, what the lamp
// sends to the ball. A convex body lights nothing of itself.
TEST_P(ClosedRoom, WallsReceiveWhatTheBallReflects) {
  constexpr float walls = 0.01f, radius = 0.1f, ball = 0.8f;
  const PointLight lamp = lamp_at({0.12f, -0.2f, 0.28f}, 0.002f, 30);
  ClosedScene scene = cube_room(0.05f, 1.05f * radius);
  scene.albedo = walls;
  scene.sky = 0;
  scene.lamps = {lamp};
  scene.radiance = [lamp](const Eigen::Vector3f& p) {
    int axis = 0;
    p.cwiseAbs().maxCoeff(&axis);
    Eigen::Vector3f n = Eigen::Vector3f::Zero(), on = p;
    n[axis] = p[axis] > 0 ? -1.0f : 1.0f;
    on[axis] = -kHalfRoom_m * n[axis];
    return walls / kPi * irradiance(lamp, on, n);
  };
  const double sine = radius / lamp.position_m.norm();
  const double sent_W = lamp.intensity.x() * 2 * kPi * (1 - std::sqrt(1 - sine * sine));
  const float pixel_m = 2 * kHalfRoom_m / static_cast<float>(scene.width);
  scene.exhibit.objects = {sphere_object(radius, {0, 0, 0}, ball)};
  Relighter relighter(device_, scene.session());
  double gained_W = 0, lost_W = 0;
  for (int wall = 0; wall < 6; ++wall) {
    look_along(scene, wall, 1.05f * radius);
    const RelitPicture picture = scene.relit(relighter, careful_plan(64, 1));
    for (std::size_t i = 0; i < picture.maps->delta.data.size(); i += 3) {
      const float delta = picture.maps->delta.data[i];
      (delta > 0 ? gained_W : lost_W) += kPi / walls * delta * pixel_m * pixel_m;
    }
  }
  EXPECT_NEAR(lost_W, -sent_W, 0.02 * sent_W);          // the shadow, which the ball's own light hardly reaches
  EXPECT_NEAR(gained_W, ball * sent_W, 0.05 * sent_W);  // a wall sees the ball through a dozen cones
}

// A sealed room holds its own light: where its walls send out L everywhere, a white ball in it sends out L and no wall
// changes, whatever shines outside. Fields know a wall a few voxels deep, cones are wider than that when they meet it,
// and what is left of them sees the sky: of a sky 40 times as bright as the walls 1.4 % gets in, and may not be more.
TEST_P(ClosedRoom, SealedRoomKeepsTheSkyOut) {
  constexpr float radiance = 0.05f, sky = 2;
  ClosedScene scene = cube_room(0.05f, 0.36f);
  scene.focal_px = 60;
  scene.albedo = 0.8f;
  scene.sky = sky;
  scene.radiance = [](const Eigen::Vector3f&) { return radiance; };
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0}, 1)};
  scene.eye_m = {0.3f, -0.33f, 0.2f};
  scene.look_at_m = {0, 0, 0};
  for (const int volume : {32, 64}) {
    SCOPED_TRACE(volume);
    const RelitPicture picture = relit(scene, careful_plan(volume, 2));
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
