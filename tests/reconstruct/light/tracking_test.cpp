#include "reconstruct/light/tracking.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

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

}  // namespace
}  // namespace lumigraft::reconstruct
