// The fraction of light that passes transmissive objects.
#include "relight/upload/transmittance.h"

#include <gtest/gtest.h>

namespace lumigraft::test {
namespace {

relight::Material glass_with(float transmission) {
  relight::Material material{.base_color = {1, 0.5f, 0}};
  material.transmission = transmission;
  return material;
}

// The mean of Schlick's curve for the index 1.5.
constexpr float kMirrored = 0.04f + 0.96f / 21;

TEST(Transmittance, WhatIsNotMirroredPassesALosslessVolume) {
  const Eigen::Array3f passed = relight::transmittance_of(glass_with(1), 0.1f);
  EXPECT_NEAR(passed[0], 1 - kMirrored, 1e-6f);
  EXPECT_NEAR(passed[1], 0.25f * (1 - kMirrored), 1e-6f) << "two surfaces colour";
  EXPECT_EQ(passed[2], 0);
}

TEST(Transmittance, OfASheetAndOfAbsorption) {
  relight::Material material = glass_with(0.5f);
  material.thin_walled = true;
  EXPECT_NEAR(relight::transmittance_of(material, 0.1f)[1], 0.25f * (1 - kMirrored), 1e-6f);
  material = glass_with(1);
  material.attenuation_color.setConstant(0.5f);
  material.attenuation_distance_m = 0.1f;
  EXPECT_NEAR(relight::transmittance_of(material, 0.1f)[0],
              0.5f * (1 - kMirrored) * (1 - kMirrored) / (1 - 0.5f * kMirrored), 1e-6f);
  EXPECT_TRUE(relight::transmittance_of(glass_with(0), 0.1f).isZero(0));
}

}  // namespace
}  // namespace lumigraft::test
