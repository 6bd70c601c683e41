#include "reconstruct/light/tracking.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace lumigraft::reconstruct {
namespace {

PointLight lamp_at(float azimuth_rad, const Eigen::Vector3f& irradiance) {
  PointLight result;
  result.direction = Eigen::Vector3f(std::cos(azimuth_rad), std::sin(azimuth_rad), 1).normalized();
  result.irradiance = irradiance;
  return result;
}

PointLight lamp_above(const Eigen::Vector3f& irradiance) {
  PointLight result;
  result.irradiance = irradiance;
  return result;
}

const Eigen::Vector3f kWarm(1.2f, 1, 0.7f), kCool(0.7f, 0.9f, 1.1f);

class Tracking : public testing::Test {
 protected:
  /// The ids of the lamps of the next image.
  std::vector<int> see(std::vector<PointLight> lamps) {
    Illumination now;
    now.lights = std::move(lamps);
    const std::size_t seen = now.lights.size();
    tracker_.update(last_ ? &*last_ : nullptr, now);
    std::vector<int> ids;
    for (std::size_t i = 0; i < seen; ++i) ids.push_back(now.lights[i].id);
    last_ = now;
    return ids;
  }
  /// As LightStage::resolve does.
  void switch_off_hidden() {
    std::erase_if(last_->lights, [](const PointLight& lamp) { return lamp.hidden > 0; });
  }

  LightTracker tracker_{8};
  std::optional<Illumination> last_;
};

TEST_F(Tracking, ACarriedLampKeepsItsIdentity) {
  const std::vector<int> first = see({lamp_at(0, kWarm), lamp_above(kCool)});
  for (int i = 1; i < 20; ++i) {
    // A third of a radian per image: farther than an image's noise moves a lamp. Nearer lamps are brighter.
    const std::vector<int> now =
        see({lamp_at(0.3f * static_cast<float>(i), (1 + 0.4f * (i % 2)) * kWarm), lamp_above(kCool)});
    EXPECT_EQ(now, first) << i;
  }
}

TEST_F(Tracking, AnotherLampIsNotTheOneThatVanished) {
  const std::vector<int> first = see({lamp_at(0, kWarm)});
  EXPECT_NE(see({lamp_at(0.3f, kCool)}), first) << "another hue";
}

TEST_F(Tracking, ALampThatIsSwitchedOnAgainHasItsIdentity) {
  const std::vector<int> first = see({lamp_at(0, kWarm), lamp_at(2, kCool)});
  see({lamp_at(2, kCool)});
  switch_off_hidden();
  for (int i = 0; i < 20; ++i) see({lamp_at(2, kCool)});
  EXPECT_EQ(see({lamp_at(0, kWarm), lamp_at(2, kCool)}), first);
}

TEST_F(Tracking, AChangedEnvironmentIsNotAveraged) {
  const auto see_sky = [&](float radiance) {
    Illumination now;
    now.environment_sh[0].setConstant(radiance);
    tracker_.update(last_ ? &*last_ : nullptr, now);
    last_ = now;
    return now.environment_sh[0][0];
  };
  for (const float radiance : {0.0f, 1.0f, 0.5f}) EXPECT_EQ(see_sky(radiance), radiance);
  EXPECT_NEAR(see_sky(0.52f), 0.51f, 1e-6f) << "noise is";
}

/// A fixed lamp of 5° radius, and one that stays.
class CoveredLamp : public Tracking {
 protected:
  CoveredLamp() {
    lamp_ = lamp_at(0, kWarm);
    lamp_.angular_radius_rad = kRadius_rad;
    other_ = lamp_above(kCool);
    other_.angular_radius_rad = kRadius_rad;
    for (int i = 0; i < 5; ++i) EXPECT_EQ(image({lamp_, other_}).size(), 2u);
  }
  /// The fraction of the lamp's solid angle that is seen, `off_rad` from its centre.
  PointLight part(float fraction, float off_rad, float radiance = 1) const {
    PointLight result = lamp_at(off_rad / std::sqrt(0.5f), radiance * fraction * kWarm);
    result.angular_radius_rad = std::sqrt(fraction) * kRadius_rad;
    return result;
  }
  /// The lamps after an image of these, in a room of this radiance.
  std::vector<PointLight> image(std::vector<PointLight> lamps, float room = 1) {
    Illumination now;
    now.lights = std::move(lamps);
    now.environment.radiance = capture::Image<float>(16, 8, 3, 0.3f * room);
    now.environment_sh[0].setConstant(0.3f * room);
    tracker_.update(last_ ? &*last_ : nullptr, now);
    last_ = now;
    return now.lights;
  }
  static const PointLight* covered(const std::vector<PointLight>& lamps) {
    const auto found = std::find_if(lamps.begin(), lamps.end(), [](const PointLight& l) { return l.covered; });
    return found == lamps.end() ? nullptr : &*found;
  }

  static constexpr float kRadius_rad = 0.087f;
  PointLight lamp_, other_;
};

TEST_F(CoveredLamp, OfWhichAPartIsSeenStaysAsItWas) {
  const int id = last_->lights[0].id;
  // A shadow's edge comes from one side: the centroid moves to the other one.
  for (const float seen : {0.97f, 0.94f, 0.8f, 0.5f, 0.2f, 0.05f, 0.5f}) {
    const std::vector<PointLight> now = image({other_, part(seen, (1 - seen) * kRadius_rad)});
    ASSERT_EQ(now.size(), 2u) << seen;
    if (seen > 0.95f) continue;
    ASSERT_TRUE(covered(now)) << seen;
    EXPECT_EQ(covered(now)->id, id);
    EXPECT_TRUE(covered(now)->irradiance.isApprox(kWarm, 0.02f)) << seen;
    EXPECT_LT(angle_between(covered(now)->direction, lamp_.direction), 2e-3f);
    EXPECT_EQ(covered(now)->hidden, 0);
  }
  const std::vector<PointLight> after = image({lamp_, other_});
  EXPECT_EQ(after.size(), 2u);
  EXPECT_FALSE(covered(after));
}

TEST_F(CoveredLamp, InTwoPartsIsOne) {
  const std::vector<PointLight> now = image({other_, part(0.2f, 0.8f * kRadius_rad), part(0.2f, -0.8f * kRadius_rad)});
  ASSERT_EQ(now.size(), 2u);
  ASSERT_TRUE(covered(now));
}

TEST_F(CoveredLamp, WhollyStaysWhileItsRoomIsLit) {
  for (int i = 0; i < 20; ++i) {
    const std::vector<PointLight> now = image({other_}, 0.97f);
    ASSERT_EQ(now.size(), 2u) << i;
    ASSERT_TRUE(covered(now)) << i;
    EXPECT_TRUE(covered(now)->irradiance.isApprox(kWarm, 1e-3f));
  }
}

TEST_F(CoveredLamp, SwitchedOffIsNot) {
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(covered(image({other_}, 0.6f))) << i;
  EXPECT_EQ(image({other_}, 0.6f).size(), 1u);
}

TEST_F(CoveredLamp, DimmedIsNot) {
  const std::vector<PointLight> now = image({part(1, 0, 0.5f), other_}, 0.8f);
  EXPECT_FALSE(covered(now));
  EXPECT_TRUE(now[0].irradiance.isApprox(0.5f * kWarm));
}

TEST_F(CoveredLamp, CarriedAwayIsNot) {
  for (const float off_rad : {0.0f, 0.15f}) {
    const std::vector<PointLight> now = image({part(0.7f, off_rad), other_});
    EXPECT_FALSE(covered(now)) << off_rad;
    EXPECT_TRUE(now[0].irradiance.isApprox(0.7f * kWarm)) << off_rad;
    for (int i = 0; i < 5; ++i) image({lamp_, other_});
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
