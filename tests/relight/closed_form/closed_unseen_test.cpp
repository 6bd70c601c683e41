// A closed room that the camera sees partly: light that a black ball absorbs is missing on unobserved walls, and so on
// observed ones.
#include <algorithm>
#include <array>
#include <vector>

#include "reconstruct/room/enclosure.h"
#include "relight/tracing/build_trace_scene.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/gpu/device_fixture.h"
#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

constexpr float kHalf_m = 0.4f, kWalls = 0.5f, kBall_m = 0.09f;
const Vector3f kBallAt(0.05f, 0.15f, -kHalf_m + kBall_m);
const Vector3f kEye(0, -0.36f, 0.12f), kProbe(-0.2f, 0.05f, -0.37f);
constexpr float kLampRadius_m = 0.02f, kLampRadiance = 600;
const Vector3f kLampAt(-0.05f, 0.05f, 0.385f);

relight::ReferenceScene true_room() {
  relight::ReferenceScene room;
  room.real = {mesh_of(box(Vector3f::Constant(-kHalf_m), Vector3f::Constant(kHalf_m)), lambert(kWalls))};
  room.lamps = {round_panel(kLampAt, kLampRadius_m, kLampRadiance)};
  return room;
}

reconstruct::PointLight lamp() {
  reconstruct::PointLight light;
  light.distance_known = light.flat = true;
  light.position_m = kLampAt;
  light.normal = {0, 0, -1};
  light.radius_m = kLampRadius_m;
  const Vector3f down = (kProbe - kLampAt).normalized();
  light.direction = -down;
  light.intensity.setConstant(kLampRadiance * kPi * kLampRadius_m * kLampRadius_m * light.normal.dot(down));
  light.irradiance = light.intensity / (kProbe - kLampAt).squaredNorm();
  return light;
}

/// L_mu of all six walls, path traced from the middle.
class WallRadiance {
 public:
  WallRadiance() {
    const relight::DeltaPathTracer tracer = tracer_of(true_room());
    for (int wall = 0; wall < 6; ++wall) {
      relight::PosedCamera camera;
      camera.model.width = camera.model.height = kEdge;
      camera.model.fx = camera.model.fy = 0.5 * kEdge;
      camera.model.cx = camera.model.cy = 0.5 * (kEdge - 1);
      camera.T_tag_camera.linear() = axes(wall);
      const capture::Image<float> seen = tracer.radiance(camera, samples_of(48), false);
      capture::Image<float>& picture = walls_[static_cast<std::size_t>(wall)];
      picture = capture::Image<float>(kEdge, kEdge, 1);
      for (int v = 0; v < kEdge; ++v) {
        for (int u = 0; u < kEdge; ++u) {  // the median takes the lamp out, which hangs before the ceiling
          std::vector<float> around;
          for (int j = 0; j < 25; ++j) {
            around.push_back(
                seen.at(std::clamp(u + j % 5 - 2, 0, kEdge - 1), std::clamp(v + j / 5 - 2, 0, kEdge - 1), 0));
          }
          std::nth_element(around.begin(), around.begin() + 12, around.end());
          picture.at(u, v) = around[12];
        }
      }
    }
  }

  float at(const Vector3f& p) const {
    int axis = 0;
    p.cwiseAbs().maxCoeff(&axis);
    const int wall = 2 * axis + (p[axis] < 0);
    const Vector3f q = axes(wall).transpose() * p;
    const float u = 0.5f * kEdge * (q.x() / q.z() + 1) - 0.5f, v = 0.5f * kEdge * (q.y() / q.z() + 1) - 0.5f;
    const auto texel = [&](float x, float y) {
      return walls_[static_cast<std::size_t>(wall)].at(std::clamp(static_cast<int>(x), 0, kEdge - 1),
                                                       std::clamp(static_cast<int>(y), 0, kEdge - 1));
    };
    const float x = std::floor(u), y = std::floor(v), a = u - x, b = v - y;
    return (1 - b) * ((1 - a) * texel(x, y) + a * texel(x + 1, y)) +
           b * ((1 - a) * texel(x, y + 1) + a * texel(x + 1, y + 1));
  }

 private:
  static constexpr int kEdge = 20;
  static Eigen::Matrix3f axes(int wall) {
    Vector3f z = Vector3f::Zero();
    z[wall / 2] = wall % 2 ? -1.0f : 1.0f;
    const Vector3f x = z.unitOrthogonal();
    Eigen::Matrix3f m;
    m << x, z.cross(x), z;
    return m;
  }
  std::array<capture::Image<float>, 6> walls_;
};

/// Known are the floor, the back wall, and the side walls up to the ball; not the ceiling and the front wall.
ClosedScene seen_part(const WallRadiance& walls) {
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 30;
  scene.eye_m = kEye;
  scene.look_at_m = {0, 0.2f, -0.25f};
  scene.distance = [](const Vector3f& p) {
    const float half_m = 0.025f, beyond_m = box_distance(
                                     {Vector3f::Constant(-kHalf_m - half_m), Vector3f::Constant(kHalf_m + half_m)}, p);
    return std::abs(beyond_m) - half_m;
  };
  scene.extent = {Vector3f(-0.5f, -0.05f, -0.5f), Vector3f(0.5f, 0.5f, 0.25f)};
  scene.albedo = kWalls;
  scene.radiance = [&walls](const Vector3f& p) { return walls.at(p); };
  scene.lamps = {lamp()};
  scene.exhibit.objects = {sphere_object(kBall_m, kBallAt, 0)};
  return scene;
}

std::shared_ptr<const reconstruct::Illumination> fisheye_light(const WallRadiance& walls) {
  auto light = std::make_shared<reconstruct::Illumination>();
  light->probe_position_m = kProbe;
  light->lights = {lamp()};
  light->version = 1;
  light->environment.radiance = capture::Image<float>(96, 48, 3);
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 96; ++u) {
      const float phi = 2 * kPi * (static_cast<float>(u) + 0.5f) / 96 - kPi;
      const float theta = kPi * (static_cast<float>(v) + 0.5f) / 48;
      const Vector3f w(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      float t = 1e9f;
      for (int a = 0; a < 3; ++a) {
        if (w[a] != 0) t = std::min(t, (std::copysign(kHalf_m, w[a]) - kProbe[a]) / w[a]);
      }
      for (int c = 0; c < 3; ++c) light->environment.radiance.at(u, v, c) = walls.at(kProbe + t * w);
    }
  }
  return light;
}

class ClosedUnseen : public ClosedTest {
 protected:
  /// Mean change over the visible floor, outside the shadow.
  static double far_floor(const ClosedScene& scene, const capture::Image<float>& change,
                          const capture::Image<float>& coverage) {
    double sum = 0;
    int count = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        const Vector3f p = scene.on_plane(u, v, -kHalf_m);
        const bool floor = p.cwiseAbs().maxCoeff() < 0.39f + 0.011f && p.y() > 0 && std::abs(p.x()) < 0.37f;
        if (!floor || (p - kBallAt).head<2>().norm() < 2.2f * kBall_m || coverage.at(u, v) > 0) continue;
        sum += change.at(u, v, 0);
        ++count;
      }
    }
    EXPECT_GT(count, 60);
    return sum / count;
  }
};

// The reference uses the complete geometry. With only the observed part, a fifth of the change is missing; with the
// estimated enclosure, 7 %. The volumes, at 32³ with three bounces, miss 44 %, and 23 % with the enclosure; propagation
// misses 27 % and 17 %.
TEST_P(ClosedUnseen, ABlackBallIsMissedOnWallsThatWereNeverSeen) {
  const WallRadiance walls;
  const ClosedScene scene = seen_part(walls);
  const relight::PosedCamera camera{scene.session().color.model, scene.T_tag_camera().cast<float>()};
  const auto traced = [&](relight::ReferenceScene room) {
    room.objects = relight::reference_objects_of(scene.exhibit, 0);
    const relight::ReferencePicture picture = tracer_of(room).change(camera, samples_of(24));
    return far_floor(scene, picture.change, picture.coverage);
  };
  const double truth = traced(true_room());

  reconstruct::Scene seen = scene.scene();
  seen.illumination = fisheye_light(walls);
  const auto relit = [&](const char* method = "dvct") {
    relight::Relighter relighter(device_, scene.session());
    relight::Plan plan = careful_plan(32, 3);
    plan.method = method;
    const relight::RelitPicture picture = relighter.relight(scene.frame(), seen, scene.exhibit, plan, true);
    return far_floor(scene, picture.maps->delta, picture.maps->mask);
  };
  const double open = relit(), open_reference = traced(relight::reference_room_of(seen, {}));
  const std::optional<reconstruct::Enclosure> room =
      reconstruct::close_room(reconstruct::room_points(*seen.field), *seen.illumination, {kEye});
  ASSERT_TRUE(room);
  seen.enclosure = std::make_shared<const reconstruct::Enclosure>(*room);
  const double closed = relit(), propagated = relit("dlpv"),
               closed_reference = traced(relight::reference_room_of(seen, {}));
  EXPECT_LT(truth, 0);
  EXPECT_GT(open, 0.65 * truth);
  EXPECT_NEAR(closed, truth, -0.3 * truth);
  EXPECT_NEAR(propagated, truth, -0.22 * truth);
  EXPECT_GT(open_reference, 0.85 * truth);
  EXPECT_NEAR(closed_reference, truth, -0.15 * truth);
}

// Where unobserved surfaces are sources themselves (a sky), they reflect nothing, however close the hull around the
// known space is. Objects already gathered do not count twice.
TEST_P(ClosedUnseen, ASkyTakesNothingBack) {
  ClosedScene scene;
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.1f}, 0.5f)};
  relight::Relighter relighter(device_, scene.session());
  reconstruct::Scene closed = scene.scene();
  const std::optional<reconstruct::Enclosure> room =
      reconstruct::close_room(reconstruct::room_points(*closed.field), *closed.illumination, {});
  ASSERT_TRUE(room);
  closed.enclosure = std::make_shared<const reconstruct::Enclosure>(*room);
  for (const char* method : {"dvct", "dlpv"}) {
    relight::Plan plan = careful_plan(32, 2);
    plan.method = method;
    const relight::RelitPicture open = scene.relit(relighter, plan);
    const relight::RelitPicture shut = relighter.relight(scene.frame(), closed, scene.exhibit, plan, true);
    double max_difference = 0;
    for (std::size_t i = 0; i < open.maps->delta.data.size(); ++i) {
      if (open.maps->mask.data[i / 3] > 0) continue;
      max_difference =
          std::max(max_difference, std::abs(double{open.maps->delta.data[i]} - double{shut.maps->delta.data[i]}));
    }
    EXPECT_LT(max_difference, 0.02 * scene.sky) << method;
  }
}

ON_BOTH_DEVICES(ClosedUnseen);

}  // namespace
}  // namespace lumigraft::test
