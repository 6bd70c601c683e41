#include "reconstruct/exposure/surface_cells.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "reconstruct/exposure/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

/// A lamp next to the places, which may be off, and a weak environment.
std::shared_ptr<const Illumination> with_lamp(bool lit, std::uint64_t version, bool distance_known = true) {
  auto light = std::make_shared<Illumination>();
  light->version = version;
  light->environment_sh[0].setConstant(1);
  if (!lit) return light;
  PointLight lamp;
  lamp.id = 5;
  lamp.position_m = {0.4f, 0, 0.3f};
  lamp.direction = lamp.position_m.normalized();
  lamp.distance_known = distance_known;
  lamp.intensity.setConstant(1);
  lamp.irradiance = lamp.intensity / lamp.position_m.squaredNorm();
  light->lights = {lamp};
  return light;
}

/// What the place sends has little to do with what a light without occlusion predicts.
std::vector<Place> place_that_sends(float radiance) {
  return {{1234, Vector3f(0.4f, 0.1f, 0), Vector3f::UnitZ(), Array3f::Constant(radiance), 0, false}};
}

class TwoLights : public testing::Test {
 protected:
  void learn(float radiance, const std::shared_ptr<const Illumination>& light, bool gain_is_known = true) {
    cells_.set_light(light);
    cells_.learn(place_that_sends(radiance), Array3f::Ones(), gain_is_known, light);
  }
  float predicted(const std::shared_ptr<const Illumination>& light) {
    cells_.set_light(light);
    const SurfaceCell* cell = cells_.find(place_that_sends(0).front());
    return cell ? (cell->radiance * cells_.light_change(*cell, light).ratio)[0] : 0;
  }
  SurfaceCells cells_;
};

TEST_F(TwoLights, BothAreRemembered) {
  learn(0.5f, with_lamp(true, 1));
  learn(0.4f, with_lamp(false, 2));
  EXPECT_FLOAT_EQ(predicted(with_lamp(true, 3)), 0.5f);
  EXPECT_FLOAT_EQ(predicted(with_lamp(false, 4)), 0.4f);
}

TEST_F(TwoLights, TheSameLightNeedsNoDistances) {
  learn(0.5f, with_lamp(true, 1));
  const auto again = with_lamp(true, 2, false);
  EXPECT_FLOAT_EQ(predicted(again), 0.5f);
  EXPECT_LT(cells_.light_change(*cells_.find(place_that_sends(0).front()), again).log_sigma, kExposure.inlier_log);
}

TEST_F(TwoLights, NothingIsLearntWithAnUnknownGain) {
  learn(0.5f, with_lamp(true, 1), false);
  EXPECT_EQ(predicted(with_lamp(true, 1)), 0) << "a new place";
  learn(0.5f, with_lamp(true, 2));
  const float off = predicted(with_lamp(false, 3));
  std::uint64_t version = 3;
  for (int i = 1; i < kExposure.replaced_after; ++i) {
    learn(0.45f, with_lamp(false, ++version), false);
    EXPECT_FLOAT_EQ(predicted(with_lamp(false, version)), off);
  }
  learn(0.45f, with_lamp(false, ++version), false);
  EXPECT_FLOAT_EQ(predicted(with_lamp(false, version)), 0.45f) << "it stays so";
}

TEST_F(TwoLights, SurfaceThatChangedIsLearntAnew) {
  learn(0.5f, with_lamp(true, 1));
  learn(0.4f, with_lamp(false, 2));
  for (int i = 0; i < kExposure.replaced_after; ++i) learn(0.9f, with_lamp(false, 2));
  EXPECT_FLOAT_EQ(predicted(with_lamp(false, 2)), 0.9f);
  EXPECT_NE(predicted(with_lamp(true, 1)), 0.5f) << "of the surface that was there before";
}

}  // namespace
}  // namespace lumigraft::reconstruct
