// Lamps of the fish-eye image matched with lamp tags, in synthetic light.
#include "reconstruct/light/lamp_tag_matching.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "capture/camera/srgb.h"
#include "tests/reconstruct/light/light_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kRadius_m = 0.05f, kRadiance = 60;
const Vector3f kLamp(0.5f, 0.1f, 0.9f);                       // its first position
const Vector3f kOther = Vector3f(-1, -1, 1.2f).normalized();  // direction of a lamp without a tag

capture::Session session_with_lamp() {
  capture::Session session;
  session.fisheye = fisheye(180);
  session.lamps.push_back(
      {.name = "desk", .tag_id = 9, .tag_size_m = 0.06, .radius_m = kRadius_m, .normal = {}, .intensity = {}});
  return session;
}

/// The fish-eye's image of a spherical lamp (none: it is off), of the other lamp and of the room.
capture::FrameSet frame_with(const capture::Session& session, const std::optional<Vector3f>& lamp_m,
                             float clip = 1e9f) {
  const Vector3f probe = session.fisheye->T_tag_fisheye.translation().cast<float>();
  auto picture = std::make_shared<capture::Frame>();
  picture->stream = capture::Stream::fisheye;
  picture->radiance = render(*session.fisheye, [&](const Vector3f& d) -> Vector3f {
    const Vector3f to = lamp_m.value_or(Vector3f::UnitZ()) - probe;
    if (lamp_m && within(d, to.normalized(), std::asin(kRadius_m / to.norm()) / kDegree))
      return Vector3f::Constant(std::min(kRadiance, clip));
    return Vector3f::Constant(within(d, kOther, 3) ? std::min(20.0f, clip) : 0.1f);
  });
  capture::FrameSet frame;
  frame.fisheye.push_back(picture);
  return frame;
}

LampTagPose tag_at(const Vector3f& position_m, float sigma_m = 0.01f) { return {0, position_m, sigma_m, {0, 0, 0}}; }

const PointLight* tagged(const LightStage::Result& result) {
  const auto& lights = result.illumination->lights;
  const auto found = std::find_if(lights.begin(), lights.end(), [](const PointLight& l) { return l.lamp_tag == 0; });
  return found == lights.end() ? nullptr : &*found;
}

bool says(const std::vector<std::string>& warnings, const std::string& text) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const std::string& line) { return line.find(text) != std::string::npos; });
}

const float kIntensity = static_cast<float>(kRadiance * M_PI * kRadius_m * kRadius_m);

TEST(LampTagMatcher, LampInTheImageTakesTheTagsDistance) {
  const capture::Session session = session_with_lamp();
  LightStage stage(session);
  const Vector3f tag_m = kLamp * 1.01f + Vector3f(0.005f, -0.005f, 0);
  const auto result = stage.extract(frame_with(session, kLamp), {tag_at(tag_m)});
  ASSERT_EQ(result.illumination->lights.size(), 2u);
  EXPECT_TRUE(result.warnings.empty());
  const PointLight* lamp = tagged(result);
  ASSERT_TRUE(lamp);
  EXPECT_TRUE(lamp->distance_known);
  EXPECT_EQ(lamp->visibility, PointLight::Visibility::visible);
  EXPECT_NEAR(lamp->position_m.norm(), tag_m.norm(), 1e-5) << "the distance is the tag's";
  EXPECT_LT(angle_degrees(lamp->direction, kLamp), 0.3) << "and the direction mostly the image's";
  EXPECT_NEAR(lamp->distance_log_sigma, 0.01 / tag_m.norm(), 1e-5);
  EXPECT_NEAR(lamp->radius_m, kRadius_m, 1e-4);
  EXPECT_NEAR(lamp->intensity.x() / kIntensity, 1, 0.05);
}

TEST(LampTagMatcher, MovingLampKeepsItsId) {
  const capture::Session session = session_with_lamp();
  LightStage stage(session);
  const int id = stage.extract(frame_with(session, kLamp)).illumination->lights.at(0).id;
  Vector3f there = kLamp;
  for (int i = 0; i < 6; ++i) {
    const auto result = stage.extract(frame_with(session, there), {tag_at(there)});
    ASSERT_EQ(result.illumination->lights.size(), 2u) << i;
    ASSERT_TRUE(tagged(result)) << i;
    EXPECT_EQ(tagged(result)->id, id) << i;
    EXPECT_LT((tagged(result)->position_m - there).norm(), 0.01) << i;
    there += Vector3f(-0.25f, 0.05f, 0.05f);  // 10 degrees and more
  }
  // Without its tag it is tracked as a lamp without one.
  there -= Vector3f(-0.25f, 0.05f, 0.05f);
  const auto later = stage.extract(frame_with(session, there));
  ASSERT_EQ(later.illumination->lights.size(), 2u);
  EXPECT_FALSE(tagged(later));
  EXPECT_FALSE(later.illumination->lights[0].distance_known);
  EXPECT_EQ(later.illumination->lights[0].id, id);
}

TEST(LampTagMatcher, TagMovesTheLampWithoutANewImage) {
  const capture::Session session = session_with_lamp();
  LightStage stage(session);
  const capture::FrameSet frame = frame_with(session, kLamp);
  const auto first = stage.extract(frame, {tag_at(kLamp)});
  EXPECT_EQ(stage.extract(frame, {tag_at(kLamp * 1.0005f)}).illumination, first.illumination) << "noise moves nothing";
  const auto closer = stage.extract(frame, {tag_at(kLamp * 0.9f)});
  EXPECT_GT(closer.illumination->version, first.illumination->version);
  EXPECT_NEAR(tagged(closer)->position_m.norm(), 0.9 * kLamp.norm(), 1e-3);
  // The lamp moves without a new image: it keeps its power.
  const Vector3f elsewhere(-0.3f, 0.8f, 0.6f);
  const auto moved = stage.extract(capture::FrameSet(), {tag_at(elsewhere)});
  EXPECT_LT((tagged(moved)->position_m - elsewhere).norm(), 1e-3);
  EXPECT_NEAR(tagged(moved)->intensity.x() / tagged(closer)->intensity.x(), 1, 1e-3);
}

TEST(LampTagMatcher, LampThatIsOffGivesAWarning) {
  capture::Session session = session_with_lamp();
  session.lamps[0].intensity = Vector3f::Constant(5);
  LightStage stage(session);
  const int id = tagged(stage.extract(frame_with(session, kLamp), {tag_at(kLamp)}))->id;
  LightStage::Result result;
  for (int i = 0; i < 8; ++i) result = stage.extract(frame_with(session, std::nullopt), {tag_at(kLamp)});
  EXPECT_TRUE(says(result.warnings, "lamp desk: no light is visible at its tag's position")) << result.warnings.at(0);
  ASSERT_TRUE(tagged(result)) << "it may be occluded: shading decides";
  EXPECT_EQ(tagged(result)->visibility, PointLight::Visibility::dark);
  EXPECT_LT(tagged(result)->irradiance.x(), 0.01) << "until then almost no power";
  EXPECT_EQ(tagged(result)->power_log_sigma, kUnknownPowerLogSigma);
  result = stage.extract(frame_with(session, kLamp), {tag_at(kLamp)});
  EXPECT_EQ(tagged(result)->id, id);
  EXPECT_EQ(tagged(result)->visibility, PointLight::Visibility::visible);
  EXPECT_TRUE(result.warnings.empty());
}

TEST(LampTagMatcher, WrongTagPositionGivesAWarning) {
  const capture::Session session = session_with_lamp();
  LightStage stage(session);
  const Vector3f wrong_place = kLamp + Vector3f(0, 0.2f, 0);
  const auto result = stage.extract(frame_with(session, kLamp), {tag_at(wrong_place)});
  EXPECT_TRUE(says(result.warnings, "the light 11 degrees away, and position_m or tag_size_m is wrong"))
      << result.warnings.at(0);
  EXPECT_EQ(result.illumination->lights.size(), 3u);
}

TEST(LampTagMatcher, OutsideTheViewPowerIsTheLastOrTheConfigured) {
  capture::Session session = session_with_lamp();
  const Vector3f below(0.6f, 0, -0.3f);
  {
    LightStage stage(session);
    stage.extract(frame_with(session, kLamp), {tag_at(kLamp)});
    const auto gone = stage.extract(frame_with(session, std::nullopt), {tag_at(below)});
    ASSERT_TRUE(tagged(gone));
    EXPECT_LT((tagged(gone)->position_m - below).norm(), 1e-5);
    EXPECT_NEAR(tagged(gone)->intensity.x() / kIntensity, 1, 0.05);
  }
  const auto unknown = LightStage(session).extract(frame_with(session, std::nullopt), {tag_at(below)});
  ASSERT_TRUE(tagged(unknown));
  EXPECT_EQ(tagged(unknown)->visibility, PointLight::Visibility::outside_view);
  EXPECT_LT(tagged(unknown)->irradiance.x(), 0.01);
  session.lamps[0].intensity = Vector3f(5, 4, 3);
  const auto configured = LightStage(session).extract(frame_with(session, std::nullopt), {tag_at(below)});
  ASSERT_TRUE(tagged(configured));
  EXPECT_TRUE(tagged(configured)->intensity.isApprox(Vector3f(5, 4, 3)));
  EXPECT_NEAR(tagged(configured)->irradiance.x(), 5 / below.squaredNorm(), 1e-4);
}

TEST(LampTagMatcher, ConfiguredIntensityReplacesAClippedOne) {
  capture::Session session = session_with_lamp();
  session.fisheye->exposure = 1;
  session.fisheye->response = capture::Response::srgb();
  session.lamps[0].intensity = Vector3f::Constant(kIntensity);
  capture::FrameSet frame = frame_with(session, kLamp, 1);
  auto clipped = std::make_shared<capture::Frame>();
  clipped->stream = capture::Stream::fisheye;
  clipped->exposure = 1;
  const capture::Image<float>& radiance = frame.fisheye[0]->radiance;
  clipped->encoded = capture::Image<std::uint8_t>(radiance.width, radiance.height, 3);
  for (std::size_t i = 0; i < radiance.data.size(); ++i)
    clipped->encoded.data[i] = static_cast<std::uint8_t>(std::lround(255 * capture::linear_to_srgb(radiance.data[i])));
  frame.fisheye = {clipped};
  const auto known = LightStage(session).extract(frame, {tag_at(kLamp)});
  ASSERT_TRUE(tagged(known));
  EXPECT_FALSE(tagged(known)->clipped);
  EXPECT_NEAR(tagged(known)->intensity.x() / kIntensity, 1, 0.01);
  session.lamps[0].intensity = Vector3f::Constant(1e-4f);  // less than the measured lower bound
  const auto wrong = LightStage(session).extract(frame, {tag_at(kLamp)});
  ASSERT_TRUE(tagged(wrong));
  EXPECT_TRUE(tagged(wrong)->clipped);
}

}  // namespace
}  // namespace lumigraft::reconstruct
