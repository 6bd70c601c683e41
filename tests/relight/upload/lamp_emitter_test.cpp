// What a scene says of a lamp is what every renderer makes of it.
#include <cmath>
#include <numbers>

#include "relight/tracing/build_trace_scene.h"
#include "relight/tracing/lamps.h"
#include "relight/upload/light_set.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

struct Lamps {
  relight::shader::Lamp gpu;
  relight::ReferenceLamp traced;
};

Lamps lamps_of(const reconstruct::PointLight& light, const Eigen::Vector3f& probe_m) {
  reconstruct::Illumination illumination;
  illumination.probe_position_m = probe_m;
  illumination.lights = {light};
  illumination.environment.radiance = capture::Image<float>(8, 4, 3, 0.0f);
  relight::ReferenceScene room;
  relight::light_room(illumination, room);
  return {relight::make_light_set(illumination, 1).lamps.at(0), room.lamps.at(0)};
}

/// W/sr towards a unit direction.
float sent(const relight::shader::Lamp& lamp, const Eigen::Vector3f& towards) {
  const float a = lamp.facing.w();
  return lamp.intensity.x() * (a > 0 ? a * std::max(lamp.facing.head<3>().dot(towards), 0.0f) : 1.0f);
}
float sent(const relight::ReferenceLamp& lamp, const Eigen::Vector3f& towards) {
  if (lamp.shape == relight::ReferenceLamp::Shape::sphere)
    return lamp.radiance[0] * kPi * lamp.radius_m * lamp.radius_m;
  return lamp.radiance[0] * relight::area_m2(lamp) * std::max(lamp.normal.dot(towards), 0.0f);
}

// Light of a panel that the probe sees nearly edge on was found, or set, with the same bound for its slant.
TEST(LampEmitter, APanelShinesAsTheSceneSaysHoweverTheProbeSeesIt) {
  const Eigen::Vector3f probe_m(0.1f, 0, 0.3f);
  for (const float cosine : {1.0f, 0.5f, 0.1f, 0.05f, 0.02f, 0.005f, -0.1f}) {
    SCOPED_TRACE(cosine);
    reconstruct::PointLight panel = lamp_at({0.5f, -0.2f, 1.1f}, 0.1f, 2);
    panel.direction = (panel.position_m - probe_m).normalized();
    const Eigen::Vector3f across = panel.direction.unitOrthogonal();
    panel.flat = true;
    panel.normal = -cosine * panel.direction + std::sqrt(1 - cosine * cosine) * across;
    const Lamps lamps = lamps_of(panel, probe_m);
    for (const float turn : {0.0f, 0.7f, 1.4f, 3.0f}) {
      const Eigen::Vector3f towards = std::cos(turn) * panel.normal + std::sin(turn) * panel.normal.unitOrthogonal();
      const float wanted = panel.intensity.x() * panel.emission(towards);
      EXPECT_NEAR(sent(lamps.gpu, towards), wanted, 1e-4f * wanted + 1e-6f) << turn;
      EXPECT_NEAR(sent(lamps.traced, towards), wanted, 1e-4f * wanted + 1e-6f) << turn;
    }
  }
}

TEST(LampEmitter, APanelHasTheOutlineThatTheProbeSees) {
  const Eigen::Vector3f probe_m(0.1f, 0, 0.3f);
  reconstruct::PointLight panel = lamp_at({0.5f, -0.2f, 1.1f}, 0.1f, 2);
  const Eigen::Vector3f way = panel.position_m - probe_m;
  panel.direction = way.normalized();
  panel.flat = true;
  panel.normal = Eigen::Vector3f(-0.4f, 0.3f, -1).normalized();
  const Eigen::Vector3f across = panel.direction.unitOrthogonal();
  panel.outline_u = 0.16f * across + 0.01f * panel.direction.cross(across);
  panel.outline_v = 0.04f * panel.direction.cross(across);
  const relight::ReferenceLamp lamp = lamps_of(panel, probe_m).traced;
  ASSERT_EQ(lamp.shape, relight::ReferenceLamp::Shape::ellipse);
  for (const auto& [half_m, tangent] :
       {std::pair(lamp.half_u_m, panel.outline_u), std::pair(lamp.half_v_m, panel.outline_v)}) {
    EXPECT_NEAR(half_m.dot(panel.normal), 0, 1e-5f);
    const Eigen::Vector3f seen = half_m - half_m.dot(panel.direction) * panel.direction;
    EXPECT_LT((seen / way.norm() - tangent).norm(), 1e-5f);
  }
  EXPECT_NEAR(sent(lamp, panel.normal), panel.intensity.x() * panel.emission(panel.normal), 1e-4f);

  // Points inside the outline, and outside.
  for (int i = 0; i < 64; ++i) {
    const Eigen::Vector2f u((static_cast<float>(i) + 0.5f) / 64, std::fmod(0.618034f * static_cast<float>(i), 1.0f));
    const Eigen::Vector3f to = (relight::point_on(lamp, u) - probe_m).normalized();
    EXPECT_TRUE(relight::lamp_hit(lamp, probe_m, to).has_value()) << i;
    const Eigen::Vector3f rim = relight::point_on(lamp, {1.02f, u.y()});
    EXPECT_FALSE(relight::lamp_hit(lamp, probe_m, (rim - probe_m).normalized()).has_value()) << i;
    EXPECT_LE((rim - lamp.centre_m).norm(), 1.02f * relight::lamp_reach_m(lamp));
  }
}

TEST(LampEmitter, OneWithoutADistanceKeepsItsIrradiance) {
  reconstruct::PointLight far;
  far.direction = Eigen::Vector3f(0.6f, 0, 0.8f);
  far.irradiance.setConstant(0.7f);
  for (const float angle_rad : {0.0f, 0.005f, 0.2f, 1.2f}) {
    SCOPED_TRACE(angle_rad);
    far.angular_radius_rad = angle_rad;
    const Eigen::Vector3f probe_m(0.1f, 0, 0.3f);
    const Lamps lamps = lamps_of(far, probe_m);
    const Eigen::Vector3f centre_m = lamps.gpu.position_radius.head<3>();
    const float d2 = (centre_m - probe_m).squaredNorm();
    EXPECT_GT(d2, 50 * 50);
    EXPECT_EQ(lamps.traced.centre_m, centre_m);
    EXPECT_EQ(lamps.traced.radius_m, lamps.gpu.position_radius.w());
    EXPECT_NEAR(sent(lamps.gpu, -far.direction) / d2, 0.7f, 1e-4f);
    EXPECT_NEAR(sent(lamps.traced, -far.direction) / d2, 0.7f, 1e-4f);
  }
}

}  // namespace
}  // namespace lumigraft::test
