// Components of delta final gathering with known results.
#include <cmath>
#include <random>

#include "relight/gather/irradiance_change_cache.h"
#include "relight/gather/low_res_view.h"
#include "relight/gather/object_window.h"
#include "relight/tracing/lamps.h"
#include "relight/tracing/light_samples.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

// Half of the shadow rays represent the whole lamp; no ray of the other half is sent.
TEST(ShadowRayPacket, ItsFirstRaysRepresentAll) {
  relight::ReferenceLamp lamp;
  lamp.centre_m = {0.2f, 0, 1};
  lamp.radius_m = 0.2f;
  const relight::LightSampleSet points(lamp, 1);
  relight::SurfaceHit floor;
  for (int set = 0; set < relight::LightSampleSet::kSets; ++set) {
    relight::ShadowRayPacket fan = points.from(floor, set);
    fan.keep_first(8);
    EXPECT_EQ(fan.rays.some >> 8, 0u);
    EXPECT_NEAR(fan.all, points.unhidden(floor), 0.05f * points.unhidden(floor)) << set;
    for (std::size_t k = 8; k < fan.weight.size(); ++k) EXPECT_EQ(fan.weight[k], 0);
  }
}

// The field holds a bulb's body up to a tenth too wide, or as far from its place: it does not occlude the bulb.
TEST(ShadowRayPacket, EndsBeforeTheBodyOfABulb) {
  relight::ReferenceLamp lamp;
  lamp.centre_m = {0.2f, 0, 1};
  lamp.radius_m = 0.05f;
  relight::SurfaceHit floor;
  const auto nearest_end_m = [&] {
    const relight::RayFan rays = relight::LightSampleSet(lamp, 1).from(floor, 0).rays;
    float nearest = 1e9f;
    for (std::size_t k = 0; k < relight::RayFan::kMaxRays; ++k)
      nearest = std::min(nearest, (rays.from_m + rays.limit_m[k] * rays.w[k] - lamp.centre_m).norm());
    return nearest;
  };
  EXPECT_GT(nearest_end_m(), 1.1f * lamp.radius_m);
  EXPECT_LT(nearest_end_m(), 1.6f * lamp.radius_m) << "what is farther occludes it";
  lamp.shape = relight::ReferenceLamp::Shape::disc;
  lamp.normal = -Eigen::Vector3f::UnitZ();
  EXPECT_LT(nearest_end_m(), lamp.radius_m) << "a panel is thin";
}

// The estimated enclosure has vertices far apart; light varies between them, too.
TEST(IrradianceChangeCache, HoldBetweenPatchesThatLieFarApart) {
  const Eigen::Vector3f up = Eigen::Vector3f::UnitZ();
  std::vector<relight::Patch> floor;
  for (int x = -8; x <= 8; ++x) {
    for (int y = -8; y <= 8; ++y)
      floor.push_back({{0.1f * static_cast<float>(x), 0.1f * static_cast<float>(y), 0}, up});
  }
  relight::IrradianceChangeCache cells(floor, {{0, 0, 0.2f}, 0.15f}, relight::RayObjects({}));
  cells.irradiance.assign(cells.cells().size(), relight::Rgb::Constant(-1));
  for (int i = 0; i < 700; ++i) {
    const Eigen::Vector3f p(-0.7f + 0.002f * static_cast<float>(i), 0.65f - 0.0017f * static_cast<float>(i), 0);
    ASSERT_EQ(cells.at(p, up)[0], -1) << p.transpose();
  }
  EXPECT_EQ(cells.at({0.3f, 0.3f, 0}, -up)[0], 0) << "from below nothing is known";
}

// A wide glow is represented by several discs that may overlap: the light of all counts.
TEST(ReferenceLamps, ThoseOfUnknownPlaceHideNoOther) {
  relight::ReferenceLamp near, far;
  near.centre_m = {0, 0, 90};
  far.centre_m = {5, 0, 100};
  near.radius_m = far.radius_m = 20;
  const std::vector<relight::ReferenceLamp> solid{near, far};
  EXPECT_TRUE(relight::behind_other_lamp(solid, 1, {0, 0, 0}, Eigen::Vector3f::UnitZ(), 80));
  near.hides = false;
  const std::vector<relight::ReferenceLamp> glow{near, far};
  EXPECT_FALSE(relight::behind_other_lamp(glow, 1, {0, 0, 0}, Eigen::Vector3f::UnitZ(), 80));
  EXPECT_TRUE(relight::behind_other_lamp(glow, 0, {0, 0, 20}, Eigen::Vector3f::UnitZ(), 80));
}

capture::CameraModel camera_of(int width, int height) {
  ClosedScene scene;
  scene.width = width;
  scene.height = height;
  return scene.session().color.model;
}

/// A wall at 1 m left of a column, one at 2 m from there on.
std::vector<relight::GBufferPixel> two_walls(const capture::CameraModel& camera, int column) {
  std::vector<relight::GBufferPixel> seen;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      relight::GBufferPixel& p = seen.emplace_back();
      p.known = true;
      p.depth_m = u < column ? 1 : 2;
      p.surface.position_m = p.depth_m * camera.unproject({u, v})->cast<float>();
      p.surface.face = p.surface.normal = -Eigen::Vector3f::UnitZ();
    }
  }
  return seen;
}

TEST(LowResView, MixesLinearlyWithinASurfaceAndNothingOfAnother) {
  const capture::CameraModel camera = camera_of(47, 31);
  constexpr int column = 21, block = 4;
  const std::vector<relight::GBufferPixel> seen = two_walls(camera, column);
  const relight::LowResView view(seen, camera, block);
  // What the blocks hold: the column that their surface is seen at, and a thousand more on the far wall.
  const auto value = [&](std::size_t i) {
    const relight::GBufferPixel& p = view.seen()[i];
    const auto column_of = static_cast<float>(camera.project(p.surface.position_m.cast<double>())->x());
    return p.depth_m > 1.5f ? column_of + 1000 : column_of;
  };
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const relight::BlockMix mix = view.mix(u, v, seen[static_cast<std::size_t>(v * camera.width + u)].surface);
      int sum = 0;
      for (const std::uint8_t weight : mix.weight) sum += weight;
      ASSERT_EQ(sum, 255) << u << ", " << v;
      const float mixed = view.mixed(mix, value), expected = static_cast<float>(u) + (u < column ? 0 : 1000);
      // At the wall's end and the picture's there is a block on one side alone.
      const bool between = (u >= block && u < column - block) || (u >= column + block && u < camera.width - block);
      ASSERT_NEAR(mixed, expected, between ? 0.1 : block) << u << ", " << v;
    }
  }
}

TEST(LowResView, SaysNothingWhereNothingIsSeen) {
  const capture::CameraModel camera = camera_of(8, 8);
  std::vector<relight::GBufferPixel> seen = two_walls(camera, 8);
  const relight::SurfaceHit own = seen.front().surface;
  for (relight::GBufferPixel& p : seen) p.known = false;
  const relight::LowResView view(seen, camera, 2);
  const relight::BlockMix mix = view.mix(3, 3, own);
  EXPECT_TRUE(mix.empty());
  EXPECT_EQ(view.mixed(mix, [](std::size_t) { return 5.0f; }), 0);
}

/// Whether the window holds every pixel that looks at a sphere, and how many pixels it holds.
int pixels_of_window(const Eigen::Vector4f& sphere, const capture::CameraModel& camera) {
  const relight::PixelRays pixel_rays(camera);
  const relight::CameraRays eye{pixel_rays, {camera, Eigen::Isometry3f::Identity()}};
  const relight::PixelWindow window = relight::window_of({sphere}, eye);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3f w = eye.ray(u, v), to = sphere.head<3>();
      const bool seen = to.norm() <= sphere.w() || (to.dot(w) > 0 && to.cross(w).norm() < sphere.w());
      const bool within =
          u >= window.left && u < window.left + window.width && v >= window.top && v < window.top + window.height;
      EXPECT_TRUE(within || !seen) << u << ", " << v;
    }
  }
  return window.width * window.height;
}

TEST(ObjectWindow, HoldsAllThatShowsAnObject) {
  const capture::CameraModel camera = camera_of(100, 70);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> place(-1.5f, 1.5f), size(0.01f, 0.5f);
  for (int i = 0; i < 200; ++i) {
    pixels_of_window({place(random), place(random), place(random), size(random)}, camera);
  }
  EXPECT_LE(pixels_of_window({0, 0, 2, 0.05f}, camera), 32 * 32);
  EXPECT_EQ(pixels_of_window({0, 0, -2, 0.5f}, camera), 0);
  EXPECT_EQ(pixels_of_window({0.1f, 0, 0, 0.5f}, camera), 7000);
}

}  // namespace
}  // namespace lumigraft::test
