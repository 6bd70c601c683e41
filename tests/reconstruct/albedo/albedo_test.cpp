#include "reconstruct/albedo/albedo.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <fstream>

#include "capture/error.h"
#include "reconstruct/shading/surface_samples.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

TestLamp bulb() { return {{0.4f, -0.5f, 0.9f}, {1.2f, 1.0f, 0.8f}, 0.04f}; }

/// Mean |albedo - truth| over a grid of floor points, and the number of unknown ones.
struct FloorError {
  double mean = 0;
  int known = 0, unknown = 0;
};
template <typename Skip>
FloorError floor_error(const TestRoom& room, const AlbedoField& field, Skip skip) {
  FloorError error;
  for (float x = -0.5f; x <= 0.5f; x += 0.04f) {
    for (float y = -0.5f; y <= 0.5f; y += 0.04f) {
      const Eigen::Vector3f p(x, y, 0);
      if (skip(p)) continue;
      const auto [albedo, sigma] = albedo_at(field, p);
      if (sigma < 0) {
        ++error.unknown;
        continue;
      }
      error.mean += (albedo - room.albedo(p)).cwiseAbs().mean();
      ++error.known;
    }
  }
  error.mean /= std::max(error.known, 1);
  return error;
}
const auto kNowhere = [](const Eigen::Vector3f&) { return false; };

/// A print sampled on an 8 mm grid: a black frame 2 cm wide, white around it and in the left half inside.
std::vector<SurfacePoint> printed(float white, float max) {
  std::vector<SurfacePoint> points;
  for (int i = -12; i <= 12; ++i) {
    for (int k = -12; k <= 12; ++k) {
      SurfacePoint point;
      point.position = 0.008f * Eigen::Vector3f(static_cast<float>(i), static_cast<float>(k), 0);
      point.normal = Eigen::Vector3f::UnitZ();
      float fraction = 0;  // of white, over a voxel
      for (int s = 0; s < 16; ++s) {
        const float x = point.position.x() + 0.002f * (static_cast<float>(s % 4) - 1.5f);
        const float y = point.position.y() + 0.002f * (static_cast<float>(s / 4) - 1.5f);
        const float out = std::max(std::abs(x), std::abs(y));
        fraction += out > 0.08f || (out < 0.06f && x < 0) ? 1.0f / 16 : 0.0f;
      }
      point.radiance = Eigen::Vector3f::Constant(white * (0.05f + 0.95f * fraction));
      if (point.radiance.x() < max) points.push_back(point);  // clipped radiance is not fused
    }
  }
  return points;
}

TEST(TagPaper, ClippedWhiteIsNotTakenForGrey) {
  const auto seen = tag_paper(printed(0.4f, 1.0f), 0.2);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->radiance.x(), 0.4, 0.01);
  EXPECT_FALSE(tag_paper(printed(0.4f, 0.24f), 0.2));
}

TEST(AlbedoStage, WhiteFurnaceIsExact) {
  TestRoom room;
  room.ambient = Eigen::Vector3f::Ones();
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  const FloorError error = floor_error(room, *result.albedo, kNowhere);
  EXPECT_EQ(error.unknown, 0);
  EXPECT_LT(error.mean, 0.01);
  EXPECT_TRUE(result.warnings.empty());
}

TEST(AlbedoStage, OneLampOnAPlane) {
  TestRoom room;
  room.lamps = {bulb()};
  room.ambient = Eigen::Vector3f::Constant(0.02f);
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  ASSERT_EQ(result.illumination->lights.size(), 1u);
  const PointLight& light = result.illumination->lights[0];
  EXPECT_TRUE(light.distance_known);
  EXPECT_FALSE(light.flat);
  EXPECT_LT((light.position_m - room.lamps[0].position).norm(), 0.05);
  EXPECT_NEAR(light.intensity.y() / room.lamps[0].intensity.y(), 1, 0.08);
  EXPECT_NEAR(light.radius_m, 0.04, 0.004);
  const FloorError error = floor_error(room, *result.albedo, kNowhere);
  EXPECT_EQ(error.unknown, 0);
  EXPECT_LT(error.mean, 0.01);
}

TEST(AlbedoStage, ClippedSurfaceGetsTheLargestOfItsBounds) {
  TestRoom room;
  room.lamps = {bulb()};
  room.ambient = Eigen::Vector3f::Constant(0.02f);
  const auto on_sheet = [](const Eigen::Vector3f& p) { return std::abs(p.x()) < 0.2f && std::abs(p.y()) < 0.2f; };
  room.albedo = [&](const Eigen::Vector3f& p) {
    return on_sheet(p) ? Eigen::Vector3f(0.85f, 0.8f, 0.75f) : Eigen::Vector3f(0.2f, 0.2f, 0.15f);
  };
  DistanceField field = room.field();
  // All of the sheet clips; at its darkest place in green alone just so.
  Eigen::Vector3f clip = Eigen::Vector3f::Constant(std::numeric_limits<float>::max());
  for (const float x : {-0.19f, 0.19f})
    for (const float y : {-0.19f, 0.19f}) {
      const Eigen::Vector3f p(x, y, 0);
      clip = clip.cwiseMin(room.albedo(p).cwiseProduct(room.irradiance(p, Eigen::Vector3f::UnitZ())) / kTestPi);
    }
  BrickMap<FieldBrick> bricks;
  for (const auto& [key, brick] : field.bricks) {
    auto seen = std::make_shared<FieldBrick>(*brick);
    BrickColor& color = seen->own_color();
    for (int i = 0; i < kBrickVoxels; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (!on_sheet(field.voxel_m * voxel_in(key, i).cast<float>())) continue;
      color.radiance[k] = color.radiance[k].cwiseMin(clip);
      color.weight[k] = 0;
    }
    bricks[key] = std::move(seen);
  }
  field.bricks = bricks;
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(field, room.illumination());
  for (const float x : {-0.15f, 0.0f, 0.15f}) {
    for (const float y : {-0.15f, 0.0f, 0.15f}) {
      const auto [albedo, sigma] = albedo_at(*result.albedo, {x, y, 0});
      EXPECT_GT(sigma, 0);
      EXPECT_LT((albedo - room.albedo({x, y, 0})).cwiseAbs().maxCoeff(), 0.1f) << x << ", " << y;
    }
  }
  const auto near_sheet = [](const Eigen::Vector3f& p) { return p.head<2>().cwiseAbs().maxCoeff() < 0.25f; };
  EXPECT_LT(floor_error(room, *result.albedo, near_sheet).mean, 0.03);
}

TEST(AlbedoStage, LampNextToABox) {
  TestRoom room;
  room.lamps = {bulb()};
  room.ambient = Eigen::Vector3f::Constant(0.01f);
  room.boxes = {{{0.05f, -0.1f, 0.0f}, {0.15f, 0.05f, 0.15f}}};
  room.albedo = [](const Eigen::Vector3f& p) {
    // Planks: the floor is not uniform.
    return Eigen::Vector3f((0.3f + 0.05f * std::sin(60 * p.x())) * Eigen::Vector3f(1, 0.8f, 0.6f));
  };
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  const PointLight& light = result.illumination->lights[0];
  EXPECT_TRUE(light.distance_known);
  const float truth = (room.lamps[0].position - room.probe).norm();
  EXPECT_NEAR((light.position_m - room.probe).norm() / truth, 1, 0.08);
  const auto far_from_box = [&](const Eigen::Vector3f& p) {
    return room.boxes[0].distance(p) < 0.06f || !room.lit(room.lamps[0], p, Eigen::Vector3f::UnitZ());
  };
  EXPECT_LT(floor_error(room, *result.albedo, far_from_box).mean, 0.025);
}

// Relighting keeps a surface's texture only if albedo contains its full contrast.
TEST(AlbedoStage, TextureKeepsItsContrast) {
  TestRoom room;
  room.lamps = {bulb()};
  room.ambient = Eigen::Vector3f::Constant(0.02f);
  const auto wave = [](const Eigen::Vector3f& p) { return std::sin(100 * p.x()) * std::sin(100 * p.y()); };  // 9 voxels
  room.albedo = [&](const Eigen::Vector3f& p) {
    return Eigen::Vector3f(Eigen::Vector3f::Constant(0.3f + 0.03f * wave(p)));
  };
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  double found = 0, true_sum = 0, found_mean = 0, true_mean = 0;
  for (int x = -50; x <= 50; ++x) {
    for (int y = -50; y <= 50; ++y) {
      const Eigen::Vector3f p = 0.008f * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), 0);
      const auto [albedo, sigma] = albedo_at(*result.albedo, p);
      ASSERT_GE(sigma, 0);
      found += albedo.y() * wave(p);
      true_sum += room.albedo(p).y() * wave(p);
      found_mean += albedo.y();
      true_mean += room.albedo(p).y();
    }
  }
  EXPECT_NEAR(found / found_mean / (true_sum / true_mean), 1, 0.08);
}

TEST(AlbedoStage, PanelIsDistinguishedFromABulbAndItsNormalFound) {
  TestRoom room;
  room.half_m = 0.8f;
  TestLamp panel{{0.3f, 0.4f, 0.8f}, {1, 1, 1}, 0.08f};
  panel.flat = true;
  panel.normal = Eigen::Vector3f(-0.5f, -0.2f, -0.8f).normalized();
  room.lamps = {panel};
  room.ambient = Eigen::Vector3f::Constant(0.02f);
  room.boxes = {{{-0.1f, -0.3f, 0.0f}, {0.05f, -0.2f, 0.12f}}};
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  const PointLight& light = result.illumination->lights[0];
  ASSERT_TRUE(light.distance_known);
  ASSERT_TRUE(light.flat);
  EXPECT_TRUE(result.warnings.empty()) << "a panel is not a beam";
  EXPECT_NEAR((light.position_m - room.probe).norm() / (panel.position - room.probe).norm(), 1, 0.1);
  EXPECT_GT(light.normal.dot(panel.normal), std::cos(0.3f));
  // Equal irradiance at points of the floor.
  for (const Eigen::Vector3f& p : {Eigen::Vector3f(0.4f, -0.4f, 0), Eigen::Vector3f(-0.4f, 0.4f, 0)}) {
    const float found = light.emission((p - light.position_m).normalized()) * light.intensity.y() /
                        (p - light.position_m).squaredNorm();
    EXPECT_NEAR(found / panel.irradiance(p, (panel.position - p).normalized()).y(), 1, 0.1);
  }
}

// A lamp deep in a tube lights a patch, as a near bulb does.
TEST(AlbedoStage, BeamIsNotTakenForANearLamp) {
  TestRoom room;
  room.half_m = 0.8f;
  TestLamp spot{{0.5f, 0.6f, 1.3f}, {2, 2, 2}, 0.05f};
  spot.flat = true;
  spot.focus = 5;
  spot.normal = Eigen::Vector3f(-0.35f, -0.4f, -1).normalized();
  room.lamps = {spot};
  room.ambient = Eigen::Vector3f::Constant(0.02f);
  room.boxes = {{{-0.1f, -0.3f, 0.0f}, {0.05f, -0.2f, 0.12f}}};
  Illumination seen = room.illumination();
  seen.lights[0].squareness = 0;  // its opening is round
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), seen);
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_NE(result.warnings[0].find("1 lamp emits a beam"), std::string::npos) << result.warnings[0];
  const PointLight& light = result.illumination->lights[0];
  ASSERT_TRUE(light.distance_known);
  EXPECT_NEAR((light.position_m - room.probe).norm() / (spot.position - room.probe).norm(), 1, 0.2);
  EXPECT_GE(light.distance_log_sigma, 0.2f);
  EXPECT_GT(light.normal.dot(spot.normal), std::cos(0.3f));
}

// The pieces of a window are one plane: their sum on a chequered floor determines its position, while the contribution
// of each piece alone is ambiguous.
TEST(AlbedoStage, PiecesOfAWindowLieInItsPlane) {
  TestRoom room;
  room.half_m = 0.8f;
  for (const float y : {-0.25f, 0.05f}) {
    TestLamp piece{{-0.7f, y, 0.75f}, {1, 1, 1}, 0.17f};
    piece.flat = true;
    piece.normal = Eigen::Vector3f::UnitX();
    room.lamps.push_back(piece);
  }
  room.ambient = Eigen::Vector3f::Constant(0.02f);
  room.boxes = {{{0.1f, -0.3f, 0.0f}, {0.25f, -0.2f, 0.12f}}};
  room.albedo = [](const Eigen::Vector3f& p) {
    const bool dark = static_cast<int>(std::floor(p.x() / 0.15f) + std::floor(p.y() / 0.15f)) % 2;
    return Eigen::Vector3f(Eigen::Vector3f::Constant(dark ? 0.25f : 0.6f));
  };
  Illumination seen = room.illumination();
  for (PointLight& light : seen.lights) light.region = 0;
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), seen);
  ASSERT_EQ(result.illumination->lights.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const PointLight& light = result.illumination->lights[i];
    ASSERT_TRUE(light.distance_known);
    ASSERT_TRUE(light.flat);
    EXPECT_GT(light.normal.x(), std::cos(0.3f));
    EXPECT_LT((light.position_m - room.lamps[i].position).norm(), 0.1f);
    EXPECT_EQ(light.irradiance, seen.lights[i].irradiance);
  }
  const Eigen::Vector3f apart = result.illumination->lights[1].position_m - result.illumination->lights[0].position_m;
  EXPECT_LT(std::abs(apart.dot(result.illumination->lights[0].normal)), 0.001f);
}

TEST(AlbedoStage, TwoLampsAtOnce) {
  TestRoom room;
  room.half_m = 0.8f;
  room.lamps = {{{0.5f, -0.6f, 0.7f}, {1.0f, 0.7f, 0.4f}, 0.04f}, {{-0.7f, 0.5f, 1.3f}, {0.8f, 1.2f, 1.8f}, 0.05f}};
  room.ambient = Eigen::Vector3f::Constant(0.02f);
  room.boxes = {{{0.05f, -0.1f, 0.0f}, {0.15f, 0.05f, 0.15f}}};
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  for (std::size_t i = 0; i < 2; ++i) {
    const float truth = (room.lamps[i].position - room.probe).norm();
    ASSERT_TRUE(result.illumination->lights[i].distance_known) << i;
    EXPECT_NEAR((result.illumination->lights[i].position_m - room.probe).norm() / truth, 1, 0.1) << i;
  }
}

/// Four panels in a ceiling over a floor of tiles.
TestRoom ceiling_of_panels() {
  TestRoom room;
  room.half_m = 0.9f;
  for (const auto& [x, y] : {std::pair{-0.8f, -0.6f}, {0.8f, -0.6f}, {-0.8f, 0.8f}, {0.8f, 0.8f}}) {
    room.lamps.push_back({{x, y, 2.3f}, {1.2f, 1.1f, 1.0f}, 0.15f, true});
  }
  room.ambient = Eigen::Vector3f::Constant(0.1f);
  room.boxes = {{{-0.7f, 0.5f, 0.0f}, {-0.3f, 0.8f, 0.22f}}, {{0.3f, 0.2f, 0.0f}, {0.48f, 0.38f, 0.16f}}};
  room.albedo = [](const Eigen::Vector3f& p) -> Eigen::Vector3f {
    const Eigen::Vector2f tile = (5 * p.head<2>()).array().floor();
    const bool dark = std::fmod(std::abs(tile.sum()), 2) > 0.5f;
    const float grain = 1 + 0.1f * std::sin(37 * p.x() + 11 * std::sin(23 * p.y()));
    return grain * (dark ? Eigen::Vector3f(0.16f, 0.2f, 0.24f) : Eigen::Vector3f(0.6f, 0.56f, 0.5f));
  };
  return room;
}

// Each distance alone is uncertain, but that none is infinite is certain.
TEST(AlbedoStage, PanelsThatShareARoomAreNotDistant) {
  const TestRoom room = ceiling_of_panels();
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  const Eigen::Vector3f object(0, 0.33f, 0.1f);
  double off = 0, off_if_far = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const PointLight& light = result.illumination->lights[i];
    const Eigen::Vector3f truth = (room.lamps[i].position - object).normalized();
    const Eigen::Vector3f found = light.distance_known ? (light.position_m - object).normalized() : light.direction;
    off += (found - truth).squaredNorm() / 4;
    off_if_far += (light.direction - truth).squaredNorm() / 4;
  }
  EXPECT_LT(std::sqrt(off), 0.6 * std::sqrt(off_if_far));
}

// The power of each alone is uncertain, too; the prior of equal radiance divides their sum.
TEST(AlbedoStage, ClippedPanelsOfOneKindShareTheirPower) {
  const TestRoom room = ceiling_of_panels();
  Illumination seen = room.illumination();
  std::vector<float> truth;
  for (PointLight& light : seen.lights) {
    truth.push_back(light.irradiance.mean());
    light.irradiance = Eigen::Vector3f::Constant(light.irradiance.mean() / 6);
    light.clipped = true;
  }
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), seen);
  ASSERT_EQ(result.illumination->lights.size(), truth.size());
  std::vector<float> off;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    off.push_back(std::log(result.illumination->lights[i].irradiance.mean() / truth[i]));
    EXPECT_LT(std::abs(off.back()), 2 * result.illumination->lights[i].power_log_sigma) << i;
  }
  const auto [min, max] = std::minmax_element(off.begin(), off.end());
  EXPECT_LT(*max - *min, 0.3f);  // 0.65 without that prior
}

// The sun is many thousand times brighter than the clipping level of an image of its sky; shadows determine its power.
TEST(AlbedoStage, PowerOfAClippedSunFromItsShadows) {
  TestRoom room;
  room.lamps = {{{40, -50, 60}, {9500, 8900, 7600}, 0.4f}};
  room.ambient = Eigen::Vector3f(0.05f, 0.06f, 0.08f);
  room.boxes = {{{-0.3f, 0.2f, 0.0f}, {-0.15f, 0.35f, 0.2f}}, {{0.2f, -0.1f, 0.0f}, {0.3f, 0.0f, 0.15f}}};
  Illumination seen = room.illumination();
  const Eigen::Vector3f truth = seen.lights[0].irradiance;
  seen.lights[0].irradiance = Eigen::Vector3f::Constant(truth.mean() / 40000);
  seen.lights[0].clipped = true;
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), seen);
  const Eigen::Vector3f found = result.illumination->lights[0].irradiance;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c] / truth[c], 1, 0.25) << c;
}

// A slow slope of the tiles' mean albedo fits a near lamp slightly better: by less than the tiles differ.
TEST(AlbedoStage, SunOverATiledFloorStaysDistant) {
  TestRoom room;
  room.lamps = {{{40, -50, 60}, {9500, 8900, 7600}, 0.4f}};
  room.ambient = Eigen::Vector3f(0.2f, 0.25f, 0.3f);
  room.boxes = {{{-0.3f, 0.2f, 0.0f}, {-0.15f, 0.35f, 0.2f}}, {{0.2f, -0.1f, 0.0f}, {0.3f, 0.0f, 0.15f}}};
  room.albedo = [](const Eigen::Vector3f& p) -> Eigen::Vector3f {
    const Eigen::Vector2f tile = (9 * p.head<2>()).array().floor();
    const float grain = 1 + 0.5f * std::sin(37 * tile.x() + 11 * std::sin(23 * tile.y()));
    const float slope = 1 + 0.12f * (p.x() - p.y());
    return grain * slope * Eigen::Vector3f(0.4f, 0.36f, 0.3f);
  };
  AlbedoStage stage{capture::Session()};
  EXPECT_FALSE(stage.solve(room.field(), room.illumination()).illumination->lights[0].distance_known);
}

TEST(AlbedoStage, SmallPatchDoesNotDetermineTheDistance) {
  TestRoom room;
  room.half_m = 0.128f;
  room.probe = {0, 0, 0.03f};
  room.lamps = {{{1.5f, -1.0f, 5.0f}, {30, 30, 30}, 0.1f}};
  room.ambient = Eigen::Vector3f::Constant(0.1f);
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  const PointLight& lamp = result.illumination->lights[0];
  ASSERT_TRUE(lamp.distance_known);
  EXPECT_LT(std::abs(std::log((lamp.position_m - room.probe).norm() / (room.lamps[0].position - room.probe).norm())),
            2 * lamp.distance_log_sigma);
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_NE(result.warnings[0].find("the distance of 1 lamp is a guess, of a usual height"), std::string::npos);
  // A lamp at a usual height is a good approximation for so small a patch.
  EXPECT_LT((albedo_at(*result.albedo, {0, 0, 0}).first - room.albedo({0, 0, 0})).cwiseAbs().mean(), 0.02);
}

TEST(AlbedoStage, UnobservedSurfaceIsUnknown) {
  TestRoom room;
  room.ambient = Eigen::Vector3f::Ones();
  room.seen = [](const Eigen::Vector3f& p) { return p.x() < 0.1f; };
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  EXPECT_GT(albedo_at(*result.albedo, {-0.2f, 0, 0}).second, 0);
  EXPECT_LT(albedo_at(*result.albedo, {0.3f, 0, 0}).second, 0);
  EXPECT_LT(albedo_at(*result.albedo, {-0.2f, 0, 0.3f}).second, 0);
}

TEST(AlbedoStage, DarknessIsUnknownNotGrey) {
  TestRoom room;
  room.lamps = {bulb()};
  // A tall box throws a black shadow: there is no ambient light.
  room.boxes = {{{-0.1f, -0.05f, 0.0f}, {0.1f, 0.15f, 0.4f}}};
  room.albedo = [](const Eigen::Vector3f&) { return Eigen::Vector3f(0.02f, 0.02f, 0.02f); };
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), room.illumination());
  int unknown = 0, all = 0;
  for (float x = -0.4f; x < 0.4f; x += 0.02f) {
    for (float y = -0.4f; y < 0.5f; y += 0.02f) {
      const Eigen::Vector3f p(x, y, 0);
      bool deep = room.boxes[0].distance(p) > 0.05f;
      for (int k = 0; k < 4 && deep; ++k) {  // 12 cm inside the shadow on all sides
        const Eigen::Vector3f q = p + 0.12f * Eigen::Vector3f(k == 0   ? 1
                                                              : k == 1 ? -1
                                                                       : 0,
                                                              k == 2   ? 1
                                                              : k == 3 ? -1
                                                                       : 0,
                                                              0);
        deep = room.boxes[0].distance(q) > 0 && !room.lit(room.lamps[0], q, Eigen::Vector3f::UnitZ());
      }
      if (!deep) continue;
      ++all;
      unknown += albedo_at(*result.albedo, p).second < 0;
    }
  }
  ASSERT_GT(all, 5);
  EXPECT_GT(unknown, 0.9 * all);
}

TEST(AlbedoStage, PowerOfAClippedLampFromItsShadowAndTheTagsPaper) {
  TestRoom room;
  room.half_m = 0.7f;
  room.lamps = {bulb()};
  room.ambient = Eigen::Vector3f::Constant(0.06f);
  room.boxes = {{{0.05f, 0.1f, 0.0f}, {0.15f, 0.25f, 0.15f}}};
  capture::Session session;
  session.tag.size_m = 0.16;
  room.albedo = [](const Eigen::Vector3f& p) {
    const bool paper = std::abs(p.x()) < 0.1f && std::abs(p.y()) < 0.1f && p.z() < 0.01f;
    const bool black = (static_cast<int>(std::floor(p.x() / 0.04f)) + static_cast<int>(std::floor(p.y() / 0.04f))) % 2;
    return paper ? Eigen::Vector3f(Eigen::Vector3f::Constant(black ? 0.04f : 0.8f))
                 : Eigen::Vector3f(0.3f, 0.25f, 0.2f);
  };
  Illumination seen = room.illumination();
  const Eigen::Vector3f truth = seen.lights[0].irradiance;
  seen.lights[0].irradiance = Eigen::Vector3f::Constant(0.004f);
  seen.lights[0].clipped = true;
  AlbedoStage stage{session};
  const auto result = stage.solve(room.field(), seen);
  const PointLight& light = result.illumination->lights[0];
  EXPECT_TRUE(light.clipped);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(light.irradiance[c] / truth[c], 1, 0.2) << c;
  EXPECT_LT((light.position_m - room.lamps[0].position).norm(), 0.12);
}

TEST(AlbedoStage, WithoutASurfaceItIsSaid) {
  TestRoom room;
  room.ambient = Eigen::Vector3f::Ones();
  const auto result = AlbedoStage{capture::Session()}.solve(DistanceField(), room.illumination());
  EXPECT_TRUE(result.albedo->bricks.empty());
  ASSERT_EQ(result.warnings.size(), 1U);
  EXPECT_NE(result.warnings[0].find("the depth frames contain no measurements"), std::string::npos);
}

TEST(AlbedoStage, MetalHasNoAlbedo) {
  const std::filesystem::path mesh = std::filesystem::path(testing::TempDir()) / "plate.obj";
  std::ofstream(mesh) << "v -0.5 0.15 0\nv 0.5 0.15 0\nv 0.5 0.5 0\nv -0.5 0.5 0\nf 1 2 3 4\n";
  capture::Session session;
  capture::RealSurface plate;
  plate.name = "plate";
  plate.mesh = mesh;
  plate.metallic = 1;
  session.real_surfaces = {plate};
  TestRoom room;
  room.ambient = Eigen::Vector3f::Ones();
  AlbedoStage stage{session};
  const auto result = stage.solve(room.field(), room.illumination());
  const auto [on_metal, metal_sigma] = albedo_at(*result.albedo, {0, 0.3f, 0});
  EXPECT_EQ(on_metal.maxCoeff(), 0);
  EXPECT_GT(metal_sigma, 0);
  EXPECT_NEAR(albedo_at(*result.albedo, {0, -0.1f, 0}).first.x(), 0.5, 0.01);

  session.real_surfaces[0].mesh = "nowhere.ply";
  EXPECT_THROW(AlbedoStage{session}, capture::InputError);
}

TEST(AlbedoStage, ReflectionIsNoLamp) {
  TestRoom room;
  room.half_m = 0.6f;
  room.lamps = {bulb()};
  room.ambient = Eigen::Vector3f::Constant(0.1f);
  room.boxes = {{{0.1f, -0.1f, 0.0f}, {0.2f, 0.2f, 0.2f}}};
  Illumination seen = room.illumination();
  PointLight false_lamp;
  false_lamp.id = 7;
  false_lamp.direction = (Eigen::Vector3f(0.1f, 0.05f, 0.1f) - room.probe).normalized();  // the box's side
  false_lamp.irradiance = Eigen::Vector3f::Constant(0.3f);
  false_lamp.angular_radius_rad = 0.05f;
  seen.lights.push_back(false_lamp);
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(room.field(), seen);
  ASSERT_EQ(result.illumination->lights.size(), 1u);
  EXPECT_EQ(result.illumination->lights[0].id, 0);
  // Its light is in the environment.
  const float band0 = std::sqrt(1 / (4 * kTestPi));
  EXPECT_NEAR(result.illumination->environment_sh[0].x() - seen.environment_sh[0].x(), 0.3f * band0, 0.01f * band0);
}

TEST(AlbedoStage, ABrightPlaceOnTheFloorIsNoLamp) {
  TestRoom room;
  room.half_m = 0.6f;
  room.lamps = {bulb()};
  room.ambient = Eigen::Vector3f::Constant(0.1f);
  room.probe = {0, 0, 0.3f};
  const DistanceField field = room.field();
  Illumination seen = room.illumination();
  PointLight glare;
  glare.id = 7;
  glare.clipped = true;
  const Eigen::Vector3f on_floor(0.3f, 0.2f, 0);
  glare.direction = (on_floor - room.probe).normalized();
  glare.angular_radius_rad = 0.05f;
  // Twice as bright as the floor: glare may be.
  const auto floor = field.radiance(on_floor);
  ASSERT_TRUE(floor);
  glare.irradiance = 2 * *floor * kTestPi * 0.05f * 0.05f;
  seen.lights.push_back(glare);
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(field, seen);
  ASSERT_EQ(result.illumination->lights.size(), 1u);
  EXPECT_EQ(result.illumination->lights[0].id, 0);
}

TEST(AlbedoStage, RepeatedInputIsNotSolvedAgainAndResultsAreDeterministic) {
  TestRoom room;
  room.lamps = {bulb()};
  room.ambient = Eigen::Vector3f::Constant(0.02f);
  room.boxes = {{{0.05f, -0.1f, 0.0f}, {0.15f, 0.05f, 0.15f}}};
  const DistanceField field = room.field();
  const Illumination seen = room.illumination();
  AlbedoStage first{capture::Session()}, second{capture::Session()};
  const auto a = first.solve(field, seen), again = first.solve(field, seen), b = second.solve(field, seen);
  EXPECT_EQ(a.albedo, again.albedo);
  EXPECT_EQ(a.illumination, again.illumination);
  EXPECT_EQ(a.illumination->lights[0].position_m, b.illumination->lights[0].position_m);
  ASSERT_EQ(a.albedo->bricks.size(), b.albedo->bricks.size());
  for (const auto& [key, brick] : a.albedo->bricks) {
    ASSERT_TRUE(b.albedo->bricks.contains(key));
    EXPECT_EQ(brick->sigma, b.albedo->bricks.at(key)->sigma);
    EXPECT_EQ(brick->albedo, b.albedo->bricks.at(key)->albedo);
  }
  // A new version of the field without changes gives the same pointer.
  DistanceField next = field;
  next.version = 2;
  EXPECT_EQ(first.solve(next, seen).albedo, a.albedo);
  // A complete solution starts at the last estimate.
  const auto c = first.solve_complete(next, seen);
  EXPECT_GT(c.albedo->version, a.albedo->version);
  EXPECT_LT((c.illumination->lights[0].position_m - a.illumination->lights[0].position_m).norm(), 0.01);
}

}  // namespace
}  // namespace lumigraft::reconstruct
