#include "reconstruct/exposure/observed_shadows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "reconstruct/light/fluence.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

/// Two lamps above a table of 1.2 m, and a board between it and the first.
class BoardBeforeALamp : public testing::Test {
 protected:
  explicit BoardBeforeALamp(const Vector3f& of_first = Vector3f::Ones(), const Vector3f& of_second = Vector3f::Ones()) {
    add_lamp(7, {1.2f, 0, 1}, of_first);
    light_.lights[0].covered = true;
    add_lamp(3, {-1, 0.3f, 1.2f}, of_second);
    light_.environment_sh[0].setConstant(0.5f);
    for (float y = -kBoard_m; y <= kBoard_m; y += 0.02f)
      for (float z = 0; z <= 1; z += 0.05f) board_m_.emplace_back(0.8f, y, z);
    for (float x = -0.6f; x <= 0.6f; x += 0.02f)
      for (float y = -0.6f; y <= 0.6f; y += 0.02f) add_place({x, y, 0});
  }
  void add_lamp(int id, const Vector3f& position_m, const Vector3f& color) {
    PointLight lamp;
    lamp.id = id;
    lamp.distance_known = true;
    lamp.position_m = position_m;
    lamp.direction = position_m.normalized();
    lamp.intensity = 2 * color;
    lamp.irradiance = lamp.intensity / position_m.squaredNorm();
    lamp.radius_m = 0.05f;
    light_.lights.push_back(lamp);
  }
  bool behind_board(const Vector3f& p) const {
    const Vector3f& lamp = light_.lights[0].position_m;
    const float t = (0.8f - p.x()) / (lamp.x() - p.x());
    return std::abs(p.y() + t * (lamp.y() - p.y())) < kBoard_m;
  }
  void add_place(const Vector3f& p) {
    const Array3f of_first = lamp_irradiance(light_.lights[0], p, Vector3f::UnitZ()),
                  of_second = lamp_irradiance(light_.lights[1], p, Vector3f::UnitZ()),
                  all = of_first + of_second + 0.5f;
    const float noise = 0.02f * std::sin(100 * p.x() + 300 * p.y());
    const Array3f hue_noise(0.01f * std::sin(500 * p.x()), 0.01f * std::sin(400 * p.y()), 0);
    const float hidden = behind_board(p) ? 1 : 0;
    places_.push_back(
        {p, Vector3f::UnitZ(), 1 - hidden * of_first / all + noise + hue_noise, {of_first / all, of_second / all}});
  }
  /// Mean error of the visible fraction of a lamp over points above the table.
  float error(const LampShadows& shadows, std::size_t lamp) const { return error(shadows, lamp, -0.1f, 0, 0.2f); }
  /// Over points between x_m and x_m + 0.4, and between the heights.
  float error(const LampShadows& shadows, std::size_t lamp, float x_m, float low_m, float high_m) const {
    const LampShadow* shadow = shadows.of(light_.lights[lamp].id);
    float sum = 0;
    int points = 0;
    for (float x = x_m; x <= x_m + 0.4f; x += 0.05f)
      for (float y = -0.25f; y <= 0.25f; y += 0.05f)
        for (float z = low_m; z <= high_m; z += 0.05f) {
          const Vector3f p(x, y, z);
          const float open = lamp == 0 && behind_board(p) ? 0 : 1;
          sum += std::abs((shadow ? shadow->open_at(p) : 1) - open);
          ++points;
        }
    return sum / static_cast<float>(points);
  }

  static constexpr float kBoard_m = 0.06f;
  Illumination light_;
  std::vector<Vector3f> board_m_;
  std::vector<ShadowedPlace> places_;
};

TEST_F(BoardBeforeALamp, ShadesWhatStandsOnTheTable) {
  const auto shadows = observe_shadows(places_, board_m_, light_);
  ASSERT_TRUE(shadows);
  EXPECT_LT(error(*shadows, 0), 0.12f);
  EXPECT_LT(error(*shadows, 1), 0.05f);
}

TEST_F(BoardBeforeALamp, WhoseLightItHidesIsKnownWithoutSeeingIt) {
  const auto shadows = observe_shadows(places_, {}, light_);
  ASSERT_TRUE(shadows);
  EXPECT_LT(error(*shadows, 0), 0.25f);
  EXPECT_LT(error(*shadows, 1), 0.1f);
}

/// An amber lamp with the board, and a blue one.
class BoardBeforeAnAmberLamp : public BoardBeforeALamp {
 protected:
  BoardBeforeAnAmberLamp() : BoardBeforeALamp({1.4f, 1, 0.6f}, {0.7f, 0.9f, 1.3f}) {}
};

/// Far from the lamp it gives a quarter of the light: the missing colour says that it is its light.
TEST_F(BoardBeforeAnAmberLamp, TakesTheLampsOwnColour) {
  const auto shadows = observe_shadows(places_, {}, light_);
  ASSERT_TRUE(shadows);
  EXPECT_LT(error(*shadows, 0, -0.5f, 0, 0), 0.2f);
  EXPECT_LT(error(*shadows, 1, -0.5f, 0, 0), 0.05f);
}

/// The light that reaches an object's upper part would fall beside the table, where no shadow can be seen.
TEST_F(BoardBeforeAnAmberLamp, ShadesWhatReachesBeyondItsShadowOnTheTable) {
  const auto shadows = observe_shadows(places_, board_m_, light_);
  ASSERT_TRUE(shadows);
  EXPECT_LT(error(*shadows, 0, -0.55f, 0.2f, 0.4f), 0.15f);
  EXPECT_LT(error(*shadows, 1, -0.55f, 0.2f, 0.4f), 0.05f);
}

TEST_F(BoardBeforeALamp, ThatTheFisheyeDoesNotSeeIsLeftToDepth) {
  light_.lights[0].covered = false;
  EXPECT_FALSE(observe_shadows(places_, board_m_, light_));
}

TEST_F(BoardBeforeALamp, ThatIsGoneLeavesNoShadow) {
  for (ShadowedPlace& place : places_) place.ratio.setConstant(0.98f);
  EXPECT_FALSE(observe_shadows(places_, board_m_, light_));
}

TEST_F(BoardBeforeALamp, IsNoneUnderTheTable) {
  // Below the table's edge it was always dark, and the floor there is as before.
  for (float x = -0.8f; x <= 0; x += 0.02f)
    for (float y = -0.3f; y <= 0.3f; y += 0.02f) {
      const Vector3f p(x, y, -0.7f);
      const Array3f of_first = lamp_irradiance(light_.lights[0], p, Vector3f::UnitZ());
      places_.push_back({p, Vector3f::UnitZ(), Array3f::Ones(), {of_first / (of_first + 1), Array3f::Constant(0.1f)}});
    }
  const auto shadows = observe_shadows(places_, board_m_, light_);
  ASSERT_TRUE(shadows);
  EXPECT_LT(error(*shadows, 0), 0.2f);
}

/// The table next to a box that hides the lamp from it is as dark as before: that is no light of the lamp.
TEST_F(BoardBeforeALamp, IsAsIfWhatABoxAlwaysShadesWereNotSeen) {
  constexpr float kFront_m = 0.2f, kWide_m = 0.12f, kHigh_m = 0.25f;
  const Vector3f& lamp_m = light_.lights[0].position_m;
  std::vector<ShadowedPlace> others;
  for (ShadowedPlace& place : places_) {
    const float t = (kFront_m - place.position_m.x()) / (lamp_m.x() - place.position_m.x());
    const Vector3f crossed_m = place.position_m + t * (lamp_m - place.position_m);
    if (t > 0 && std::abs(crossed_m.y()) < kWide_m && crossed_m.z() < kHigh_m)
      place.ratio.setOnes();
    else
      others.push_back(place);
  }
  for (float y = -kWide_m; y <= kWide_m; y += 0.02f)
    for (float z = 0.02f; z <= kHigh_m; z += 0.02f) {
      const Vector3f p(kFront_m, y, z);
      const Array3f of_first = lamp_irradiance(light_.lights[0], p, Vector3f::UnitX());
      const ShadowedPlace place{
          p, Vector3f::UnitX(), 0.5f / (of_first + 0.5f), {of_first / (of_first + 0.5f), Array3f::Zero()}};
      places_.push_back(place);
      others.push_back(place);
    }
  const auto wanted = observe_shadows(others, board_m_, light_);
  ASSERT_TRUE(wanted);
  // Mean difference above the shaded table.
  const auto difference = [&] {
    const auto found = observe_shadows(places_, board_m_, light_);
    float sum = 0;
    for (float x = -0.1f; x < 0.15f; x += 0.01f)
      for (float y = -0.1f; y <= 0.1f; y += 0.02f)
        sum += std::abs(found->of(7)->open_at({x, y, 0.02f}) - wanted->of(7)->open_at({x, y, 0.02f})) / (25 * 11);
    return sum;
  };
  EXPECT_LT(difference(), 0.05f);
  // What lies below no other surface is used.
  for (ShadowedPlace& place : places_) place.normal *= -1;
  EXPECT_GT(difference(), 0.1f);
}

}  // namespace
}  // namespace lumigraft::reconstruct
