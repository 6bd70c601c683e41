// What an error of a sample's albedo consists of.
#include "reconstruct/albedo/sample_solver.h"

#include <gtest/gtest.h>

#include <numbers>

#include "reconstruct/shading/noise_floor.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

SurfaceSample grey(float radiance) {
  SurfaceSample sample;
  sample.position = Vector3f::Zero();
  sample.normal = Vector3f::UnitZ();
  sample.radiance = Vector3f::Constant(radiance);
  return sample;
}

TEST(SampleErrors, NoiseAndModelShareTheVariance) {
  constexpr float kRadiance = 0.1f, kNoiseFloor = 0.01f;
  const SampleLight certain{Vector3f::Ones(), 0};
  EXPECT_NEAR(noise_in_data(grey(kRadiance), certain, kNoiseFloor), 1, 1e-5);
  // The model's error that equals noise.
  const float equal = noise_floor_sigma(kNoiseFloor) / (std::numbers::pi_v<float> * kRadiance);
  EXPECT_NEAR(noise_in_data(grey(kRadiance), {Vector3f::Ones(), equal}, kNoiseFloor), 0.5, 1e-4);
  EXPECT_NEAR(noise_in_data(grey(kRadiance), {Vector3f::Ones(), 3 * equal}, kNoiseFloor), 0.1, 1e-4);
}

TEST(SampleErrors, MisfitCountsLessInUncertainLight) {
  const SurfaceSample sample = grey(0.5f * std::numbers::inv_pi_v<float>);
  const auto misfit = [&](float albedo, float light_sigma) {
    return misfit_sigma(sample, {Vector3f::Ones(), light_sigma}, Vector3f::Constant(albedo), 0);
  };
  EXPECT_NEAR(misfit(0.5f, 0.05f), 0, 1e-4);
  EXPECT_NEAR(misfit(0.7f, 0.05f), 0.1, 1e-3);
  EXPECT_NEAR(misfit(0.7f, 0.4f), 0.025, 1e-3);
}

}  // namespace
}  // namespace lumigraft::reconstruct
