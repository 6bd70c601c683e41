// What closes a room where no camera looked is a guess, and lamps that the fish-eye saw may stand beyond it, or as far
// away as the sun: it hides none of them.
#include <cmath>

#include "reconstruct/room/enclosure.h"
#include "relight/tracing/build_trace_scene.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

/// A metal ball on a floor under a lamp 1.6 m above and a far one; nothing else shines.
ClosedScene ball_under_lamps() {
  ClosedScene scene;
  scene.sky = 0;
  reconstruct::PointLight far = lamp_at(Vector3f(0, 1, 1.2f).normalized(), 0, 0);
  far.distance_known = false;
  far.irradiance.setConstant(1);
  far.angular_radius_rad = 0.05f;
  scene.lamps = {lamp_at({0.5f, -0.1f, 1.6f}, 0.05f, 3), far};
  scene.exhibit.objects = {sphere_object(0.15f, {0, 0, 0.15f}, 0)};
  scene.exhibit.objects[0].material = metal(0.8f, 0.6f);
  return scene;
}

/// A black ceiling and black walls between the ball and the lamps.
std::shared_ptr<const reconstruct::Enclosure> low_hull() {
  auto room = std::make_shared<reconstruct::Enclosure>();
  room->sides = {{Vector3f::UnitZ(), 0, true},   {-Vector3f::UnitZ(), 0.9f, false}, {Vector3f::UnitX(), 1, false},
                 {-Vector3f::UnitX(), 1, false}, {Vector3f::UnitY(), 1, false},     {-Vector3f::UnitY(), 1, false}};
  room->middle_m = {0, 0, 0.45f};
  return room;
}

double squares(const capture::Image<float>& a, const capture::Image<float>* b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - (b ? b->data[i] : 0), 2);
  return sum;
}

TEST(LampsBeyond, AGuessedSideHidesNoneFromRays) {
  const ClosedScene scene = ball_under_lamps();
  relight::RayRenderer renderer(scene.session());
  const relight::Plan plan = rays_plan(1, 64);
  const relight::RelitPicture open = scene.relit(renderer, plan);
  reconstruct::Scene closed = scene.scene();
  closed.enclosure = low_hull();
  relight::RayRenderer other(scene.session());
  const relight::RelitPicture shut = other.relight(scene.frame(), closed, scene.exhibit, plan, true);
  const double shadows = squares(open.maps->delta, nullptr);
  EXPECT_GT(shadows, 10);
  EXPECT_LT(squares(shut.maps->delta, &open.maps->delta), 1e-3 * shadows);
  double ball = 0, off = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      if (open.maps->mask.at(u, v) < 1) continue;
      ball += std::pow(picture_radiance(open, u, v), 2);
      off += std::pow(picture_radiance(shut, u, v) - picture_radiance(open, u, v), 2);
    }
  }
  EXPECT_GT(ball, 10);
  EXPECT_LT(off, 1e-3 * ball);
}

TEST(LampsBeyond, NorFromTheReference) {
  const ClosedScene scene = ball_under_lamps();
  const relight::PosedCamera camera{scene.session().color.model, scene.T_tag_camera().cast<float>()};
  reconstruct::Scene room = scene.scene();
  const auto change = [&] {
    relight::ReferenceScene reference = relight::reference_room_of(room, {});
    reference.objects = relight::reference_objects_of(scene.exhibit, 0);
    return tracer_of(reference).change(camera, samples_of(16)).change;
  };
  const capture::Image<float> open = change();
  room.enclosure = low_hull();
  const capture::Image<float> shut = change();
  EXPECT_GT(squares(open, nullptr), 10);
  EXPECT_LT(squares(shut, &open), 1e-2 * squares(open, nullptr));
}

// What comes from beyond it and is no lamp is not seen through it: the side is what shines there.
TEST(LampsBeyond, ASkyIsHidden) {
  relight::ReferenceScene room;
  relight::ReferenceMesh roof = square(100, 1, lambert(0));
  roof.hides = false;
  room.real = {square(100, 0, lambert(0.5f)), roof};
  room.environment.radiance = capture::Image<float>(16, 8, 3, 1.0f);
  const relight::PosedCamera camera = looking({0, -0.3f, 0.5f}, {0, 0, 0}, 0.2f, 8, 8);
  EXPECT_LT(mean(tracer_of(room).radiance(camera, samples_of(64), false)), 0.01);
  room.lamps = {bulb({0, 0, 2}, 0.05f, 100)};
  const double expected = 0.5 * 100 * 0.05 * 0.05 / 4;  // ρ / π · L · π r² / d²
  EXPECT_NEAR(mean(tracer_of(room).radiance(camera, samples_of(64), false)), expected, 0.05 * expected);
}

}  // namespace
}  // namespace lumigraft::test
