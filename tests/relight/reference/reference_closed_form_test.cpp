// The reference in rooms whose change has a closed form. Images show one small patch, so that their mean is compared.
#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::test {
namespace {

constexpr float kAlbedo = 0.6f;

/// Mean change of a patch of a few millimetres around a point, seen from the side.
double change_at(const relight::ReferenceScene& scene, const Eigen::Vector3f& point_m, int samples = 256) {
  const relight::PosedCamera camera = looking(point_m + Eigen::Vector3f(0, -3, 0.4f), point_m, 0.001f, 4, 4);
  const relight::ReferencePicture picture = tracer_of(scene).change(camera, samples_of(samples));
  EXPECT_EQ(mean(picture.coverage), 0.0) << "the patch is behind an object";
  return mean(picture.change);
}

relight::ReferenceScene floor_under(const relight::ReferenceLamp& lamp) {
  relight::ReferenceScene scene;
  scene.real = {square(5, 0, lambert(kAlbedo))};
  scene.lamps = {lamp};
  return scene;
}

TEST(ReferenceClosed, FurnaceDoesNotChange) {
  relight::ReferenceScene scene;
  scene.background.setOnes();
  scene.real = {square(0.5f, 0, lambert(1))};
  scene.objects = {ball(0.1f, {0, 0, 0.12f}, lambert(1))};
  const relight::PosedCamera camera = looking({0, -1, 0.8f}, {0, 0, 0}, 0.6f, 24, 18);
  const relight::DeltaPathTracer tracer = tracer_of(scene);
  const relight::ReferencePicture picture = tracer.change(camera, samples_of(64));
  EXPECT_NEAR(mean(picture.change), 0, 2e-3);
  EXPECT_GT(mean(picture.coverage), 0.05);
  EXPECT_NEAR(mean(picture.object) / mean(picture.coverage), 1, 5e-3);
  EXPECT_NEAR(mean(tracer.radiance(camera, samples_of(16), true)), 1, 2e-3);
  EXPECT_NEAR(mean(tracer.radiance(camera, samples_of(16), false)), 1, 2e-3);
}

TEST(ReferenceClosed, SealedWhiteBoxAroundALampIsAsBrightAsTheLamp) {
  relight::ReferenceScene scene;
  scene.real = {mesh_of(box({-1, -1, -1}, {1, 1, 1}), lambert(1))};
  scene.lamps = {bulb({0, 0, 0.2f}, 0.7f, 3)};
  scene.objects = {mesh_of(box({0.5f, 0.5f, -1}, {0.9f, 0.9f, -0.6f}), lambert(1))};
  const relight::PosedCamera camera = looking({-0.9f, -0.9f, -0.5f}, {0.7f, 0.7f, -0.8f}, 1.5f, 24, 18);
  const relight::DeltaPathTracer tracer = tracer_of(scene);
  EXPECT_NEAR(mean(tracer.radiance(camera, samples_of(64), false)), 3, 0.03);
  EXPECT_NEAR(mean(tracer.radiance(camera, samples_of(64), true)), 3, 0.03);
  const relight::ReferencePicture picture = tracer.change(camera, samples_of(64));
  EXPECT_NEAR(mean(picture.change), 0, 0.02);
  EXPECT_NEAR(mean(picture.object) / mean(picture.coverage), 3, 0.05);
}

// A black screen close under the lamp occludes it completely: the floor loses ρ E / π.

struct LampCase {
  const char* name;
  relight::ReferenceLamp lamp;
  double irradiance;  // at the origin
};

std::vector<LampCase> lamp_cases() {
  const float h = 1.5f, a = 0.3f / h, b = 0.2f / h;
  const double rectangle =
      2 / std::numbers::pi *
      (a / std::hypot(1, a) * std::atan(b / std::hypot(1, a)) + b / std::hypot(1, b) * std::atan(a / std::hypot(1, b)));
  relight::ReferenceLamp spot = round_panel({0, 0, h}, 0.02f, 900);
  spot.cos_full = std::cos(0.3f);
  spot.cos_none = std::cos(0.5f);
  return {
      {"bulb", bulb({0, 0, h}, 0.1f, 40), kPi * 40 * std::pow(0.1 / h, 2)},
      {"panel", panel({0, 0, h}, 0.3f, 0.2f, 10), kPi * 10 * rectangle},
      {"round panel", round_panel({0, 0, h}, 0.25f, 10), kPi * 10 * 0.25 * 0.25 / (0.25 * 0.25 + h * h)},
      {"spot", spot, kPi * 900 * 0.02 * 0.02 / (0.02 * 0.02 + h * h)},
  };
}

TEST(ReferenceClosed, AHiddenLampTakesItsLightAlong) {
  for (const LampCase& c : lamp_cases()) {
    SCOPED_TRACE(c.name);
    relight::ReferenceScene scene = floor_under(c.lamp);
    scene.objects = {square(0.6f, 1.3f, lambert(0))};
    const double lost = kAlbedo / kPi * c.irradiance;
    EXPECT_NEAR(change_at(scene, {0, 0, 0}), -lost, 0.005 * lost);
    const relight::PosedCamera camera = looking({0, -3, 0.4f}, {0, 0, 0}, 0.001f, 4, 4);
    EXPECT_NEAR(mean(tracer_of(scene).radiance(camera, samples_of(256), false)), lost, 0.005 * lost);
  }
}

TEST(ReferenceClosed, ASpotIsDarkBeyondItsBeam) {
  relight::ReferenceScene scene = floor_under(lamp_cases()[3].lamp);
  scene.objects = {square(0.6f, 1.3f, lambert(0))};
  const float edge_m = 1.5f * std::tan(0.4f);  // where the spot's falloff is nearly one half
  const double cosine = std::cos(0.4), s = (cosine - std::cos(0.5)) / (std::cos(0.3) - std::cos(0.5));
  const double lost = kAlbedo / kPi * lamp_cases()[3].irradiance * std::pow(cosine, 4) * s * s * (3 - 2 * s);
  EXPECT_NEAR(change_at(scene, {edge_m, 0, 0}), -lost, 0.02 * lost);
  EXPECT_EQ(change_at(scene, {1.5f * std::tan(0.52f), 0, 0}), 0);
}

TEST(ReferenceClosed, PenumbraOfADiscUnderARoundLamp) {
  // On the axis a disc of radius q at height h occludes the lamp out to the radius q H / h.
  const float height = 1.5f, lamp_radius = 0.25f, h = 0.4f;
  relight::ReferenceScene scene = floor_under(round_panel({0, 0, height}, lamp_radius, 10));
  for (const float q : {0.03f, 0.06f, 0.1f}) {
    SCOPED_TRACE(q);
    scene.objects = {disc(q, h, lambert(0))};
    const float hidden = std::min(q * height / h, lamp_radius);
    const double lost = kAlbedo * 10 * hidden * hidden / (hidden * hidden + height * height);
    EXPECT_NEAR(change_at(scene, {0, 0, 0}, 1024), -lost, 0.02 * lost);
  }
}

TEST(ReferenceClosed, UmbraOfABallUnderABulbEndsWhereItShould) {
  // From the floor, ball and bulb subtend cones; where these are disjoint nothing is occluded, and where the bulb's is
  // inside the ball's everything is.
  relight::ReferenceScene scene = floor_under(bulb({0, 0, 2}, 0.05f, 50));
  scene.objects = {ball(0.2f, {0, 0, 0.5f}, lambert(0))};
  const auto angles = [](float x) {
    const double to_bulb = std::atan2(x, 2.0), to_ball = std::atan2(x, 0.5);
    return std::array{to_ball - to_bulb, std::asin(0.05 / std::hypot(x, 2.0)), std::asin(0.2 / std::hypot(x, 0.5))};
  };
  for (const float x : {0.1f, 0.2f, 0.24f, 0.3f, 0.4f, 0.6f}) {
    SCOPED_TRACE(x);
    const auto [apart, bulb_angle, ball_angle] = angles(x);
    const double d2 = x * x + 4.0, all = kAlbedo * 50 * 0.05 * 0.05 / d2 * 2 / std::sqrt(d2);
    const double change = change_at(scene, {x, 0, 0});
    if (apart + bulb_angle < ball_angle - 0.005) {
      EXPECT_NEAR(change, -all, 0.01 * all);
    } else if (apart - bulb_angle > ball_angle + 0.005) {
      EXPECT_NEAR(change, 0, 1e-3 * all);
    } else {
      EXPECT_LE(change, 0);
      EXPECT_GE(change, -all);
    }
  }
}

TEST(ReferenceClosed, ABlackDiscUnderAnEvenSkyTakesItsFormFactor) {
  relight::ReferenceScene scene;
  scene.background.setConstant(2);
  scene.real = {square(5, 0, lambert(kAlbedo))};
  for (const float h : {0.05f, 0.2f, 0.8f}) {
    SCOPED_TRACE(h);
    scene.objects = {disc(0.2f, h, lambert(0))};
    const double lost = 2 * kAlbedo * 0.04 / (0.04 + h * h);
    EXPECT_NEAR(change_at(scene, {0, 0, 0}, 1024), -lost, 0.01 * lost);
  }
}

// A black environment image has the same effect as none.
TEST(ReferenceClosed, ABlackEnvironmentChangesNothing) {
  for (const bool lit : {false, true}) {
    SCOPED_TRACE(lit);
    relight::ReferenceScene scene = floor_under(bulb({0, 0, 1}, 0.1f, lit ? 10 : 0));
    if (!lit) scene.lamps.clear();
    scene.objects = {ball(0.1f, {0, 0, 0.3f}, metal(0.8f, 0.4f)), ball(0.1f, {0.3f, 0, 0.1f}, lambert(0.8f))};
    const relight::PosedCamera camera = looking({0, -1, 0.8f}, {0, 0, 0.1f}, 0.8f, 24, 18);
    const relight::ReferencePicture wanted = tracer_of(scene).change(camera, samples_of(16));
    scene.environment.radiance = capture::Image<float>(32, 16, 3, 0.0f);
    const relight::ReferencePicture found = tracer_of(scene).change(camera, samples_of(16));
    EXPECT_EQ(found.change.data, wanted.change.data);
    EXPECT_EQ(found.object.data, wanted.object.data);
    for (const float light : found.object.data) ASSERT_TRUE(std::isfinite(light));
  }
}

TEST(ReferenceClosed, AMirrorShowsTheObjectInPlaceOfTheSky) {
  relight::ReferenceScene scene;
  scene.background.setConstant(2);
  scene.real = {square(5, 0, metal(0.8f, 0))};
  scene.objects = {mesh_of(box({-0.5f, 1, 0.1f}, {0.5f, 1.2f, 1.5f}), lambert(0))};
  const relight::PosedCamera camera = looking({0, -1.5f, 1}, {0, 0, 0}, 0.05f, 4, 4);
  const relight::DeltaPathTracer tracer = tracer_of(scene);
  const double cosine = 1 / std::hypot(1.5, 1), schlick = 0.8 + 0.2 * std::pow(1 - cosine, 5);
  EXPECT_NEAR(mean(tracer.radiance(camera, samples_of(64), false)), 2 * schlick, 1e-3);
  EXPECT_NEAR(mean(tracer.change(camera, samples_of(64)).change), -2 * schlick, 2e-2);
}

TEST(ReferenceClosed, AnObjectThatHidesNothingAndReflectsNothingChangesNothing) {
  relight::ReferenceScene scene = floor_under(bulb({0, 0, 1}, 0.1f, 10));
  scene.objects = {ball(0.1f, {0, 0, -1}, lambert(0.5f))};  // under the floor
  EXPECT_EQ(change_at(scene, {0.1f, 0, 0}), 0);
}

}  // namespace
}  // namespace lumigraft::test
