// A sheet on a table that clips in all frames, under a sky of radiance 1: radiance is albedo.
#include "reconstruct/albedo/clipped_albedo.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "reconstruct/field/field_rays.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kVoxel_m = 0.01f, kSheet_m = 0.08f, kBound = 0.6f;
constexpr float kRed = 1, kRedAndGreen = 3;  // bits of channels that clip

class SheetOnTable : public testing::Test {
 protected:
  /// `of_table`: albedo that was solved beyond the sheet's border, in the directions where `continues`.
  template <typename Continues>
  void build(float of_table, Continues continues) {
    build(Vector3f::Constant(of_table), continues, Vector3f::Constant(kBound), 0);
  }
  /// `of_sheet`: radiance, a lower bound in the channels `clipped`; 0: in all.
  template <typename Continues>
  void build(const Vector3f& of_table, Continues continues, const Vector3f& of_sheet, float clipped) {
    field_.voxel_m = kVoxel_m;
    field_.truncation_m = 4 * kVoxel_m;
    for (int a = -3; a < 3; ++a) {
      for (int b = -3; b < 3; ++b) {
        for (int c = -1; c < 1; ++c) {
          const BrickKey key{a, b, c};
          auto brick = std::make_shared<FieldBrick>();
          BrickColor& color = brick->own_color();
          auto albedo = std::make_shared<AlbedoBrick>();
          albedo->sigma.fill(-1);
          for (int k = 0; k < kBrickVoxels; ++k) {
            const auto i = static_cast<std::size_t>(k);
            const Vector3f p = kVoxel_m * voxel_in(key, k).cast<float>();
            const float height_m = p.z() + 0.3f * kVoxel_m;
            brick->distance_m[i] = std::clamp(height_m, -field_.truncation_m, field_.truncation_m);
            brick->weight[i] = 10;
            if (std::abs(height_m) >= kVoxel_m) continue;
            const bool sheet = std::max(std::abs(p.x()), std::abs(p.y())) < kSheet_m;
            color.radiance[i] = sheet ? of_sheet : Vector3f::Constant(0.3f);
            color.weight[i] = sheet ? -clipped : 10;
            if (sheet) continue;
            albedo->albedo[i] = continues(p) ? of_table : Vector3f::Constant(0.3f);
            albedo->sigma[i] = 0.05f;
          }
          field_.bricks[key] = brick;
          albedo_[key] = albedo;
        }
      }
    }
  }
  Vector3f channels_of_sheet() {
    const MetalMask no_metal(capture::Session{});
    EnvironmentMap sky{capture::Image<float>(16, 8, 3)};
    std::fill(sky.radiance.data.begin(), sky.radiance.data.end(), 1.0f);
    const FieldRays rays(field_);
    const IrradianceModel room(field_, rays, no_metal, nullptr, {Vector3f(0, 0, 0.05f), sky});
    extend_to_clipped(field_, no_metal, room, {}, albedo_);
    return albedo_.find({0, 0, 0})->second->albedo[0];
  }
  float of_sheet() { return channels_of_sheet().x(); }

  DistanceField field_;
  BrickMap<AlbedoBrick> albedo_;
};

TEST_F(SheetOnTable, IsBetweenItsBoundAndWhiteOnAnotherMaterial) {
  build(0.3f, [](const Vector3f&) { return false; });
  EXPECT_NEAR(of_sheet(), 0.75f, 0.02f);
}

/// As at the end of what clips where light becomes less.
TEST_F(SheetOnTable, IsItsBoundWhereItContinuesWithThat) {
  build(kBound, [](const Vector3f& p) { return p.x() > 0; });
  EXPECT_NEAR(of_sheet(), kBound, 0.02f);
}

/// As in the shadow of a box.
TEST_F(SheetOnTable, IsWhatItIsWhereItDoesNotClip) {
  build(0.8f, [](const Vector3f& p) { return p.x() > 0; });
  EXPECT_NEAR(of_sheet(), 0.8f, 0.02f);
}

/// As a light streak of wood in which red clips.
TEST_F(SheetOnTable, ChannelsThatDoNotClipAreMeasured) {
  build(
      {0.5f, 0.3f, 0.2f}, [](const Vector3f&) { return true; }, {0.5f, 0.36f, 0.24f}, kRed);
  const Vector3f albedo = channels_of_sheet();
  EXPECT_NEAR(albedo.x(), 0.6f, 0.02f) << "of the same hue";
  EXPECT_NEAR(albedo.y(), 0.36f, 0.01f);
  EXPECT_NEAR(albedo.z(), 0.24f, 0.01f);
}

/// As paper under a warm lamp.
TEST_F(SheetOnTable, IsGreyOnATableOfAnotherHue) {
  build(
      {0.5f, 0.3f, 0.2f}, [](const Vector3f&) { return true; }, {0.5f, 0.7f, 0.7f}, kRed);
  EXPECT_NEAR(channels_of_sheet().x(), 0.7f, 0.02f);
}

TEST_F(SheetOnTable, IsGreyOnATableThatIsMuchDarker) {
  build(
      Vector3f::Constant(0.3f), [](const Vector3f&) { return true; }, {0.5f, 0.5f, 0.7f}, kRedAndGreen);
  EXPECT_NEAR(channels_of_sheet().x(), 0.7f, 0.02f);
}

}  // namespace
}  // namespace lumigraft::reconstruct
