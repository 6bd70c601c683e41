// The depth bounds of a lamp map's blocks hold for every texel in them.
#include "relight/passes/lamps/lamp_maps.h"

#include <algorithm>
#include <cmath>

#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight {
namespace {

class LampMapsTest : public gpu::DeviceTest {};

TEST_P(LampMapsTest, BoundsHoldEveryTexelAndNoMore) {
  constexpr int kMapEdge = 64;
  ObjectStore store(*device_);
  Exhibit exhibit;
  exhibit.objects = {test::sphere_object(0.1f, {0.05f, 0, 0.2f}, 0.5f),
                     test::sphere_object(0.05f, {-0.2f, 0.1f, 0.1f}, 0.5f)};
  const std::vector<PlacedObject> objects = store.place(exhibit, 0);
  shader::FrameParams params{};
  params.counts.x() = 2;
  params.sphere << 0, 0, 0.15f, 0.3f;
  params.lamps[0].position_radius << 0.3f, 0.1f, 1.1f, 0.06f;
  params.lamps[1].position_radius << -0.6f, 0.4f, 0.8f, 0.1f;
  for (auto& lamp : params.lamps) {
    lamp.intensity << 1, 1, 1, 0;
    lamp.facing.setZero();
  }
  LampMaps maps(*device_, kMapEdge, 6, 2);
  maps.choose(*device_, params);
  const int count = static_cast<int>(params.lamps[0].intensity.w() + params.lamps[1].intensity.w());
  ASSERT_GE(count, 4);
  auto list = device_->begin();
  list->begin_pass("lamp maps");
  maps.record(*list, objects, false, store.white());
  device_->submit(*list);

  const std::vector<gpu::Binding> bindings = maps.bindings();
  const gpu::Texture& depths = *bindings[0].texture;
  const auto depth = gpu::values_of<float>(device_->download(depths));
  const auto views = gpu::values_of<shader::LampMap>(device_->download(*bindings[1].buffer));
  const auto bounds = gpu::values_of<std::uint32_t>(device_->download(*bindings[2].buffer));
  int covered = 0, empty = 0;
  for (int map = 0; map < count; ++map) {
    const shader::LampMap& view = views[static_cast<std::size_t>(map)];
    auto at = static_cast<std::size_t>(view.from.w());
    for (int block = 4; block <= 32; block *= 2) {
      for (int y = 0; y < kMapEdge; y += block) {
        for (int x = 0; x < kMapEdge; x += block, ++at) {
          float nearest = 1, farthest = 0;
          for (int v = y; v < y + block; ++v) {
            for (int u = x; u < x + block; ++u) {
              const int column = static_cast<int>(view.place.x()) + u, row = static_cast<int>(view.place.y()) + v;
              const float d = depth[static_cast<std::size_t>(row * depths.desc().width + column)];
              nearest = std::min(nearest, d);
              farthest = std::max(farthest, d);
            }
          }
          ASSERT_EQ(bounds[at] >> 16, static_cast<std::uint32_t>(std::floor(nearest * 65535)))
              << map << " " << block << " " << x << " " << y;
          ASSERT_EQ(bounds[at] & 0xffff, static_cast<std::uint32_t>(std::ceil(farthest * 65535)))
              << map << " " << block << " " << x << " " << y;
          covered += farthest < 1;
          empty += nearest == 1;
        }
      }
    }
  }
  EXPECT_GT(covered, 10 * count);
  EXPECT_GT(empty, 40 * count);
}

TEST_P(LampMapsTest, MapsOfWhatMovedAreSeenAsThoseOfTheObjects) {
  ObjectStore store(*device_);
  Exhibit exhibit;
  exhibit.objects = {test::sphere_object(0.1f, {0, 0, 0.2f}, 0.5f)};
  const std::vector<PlacedObject> objects = store.place(exhibit, 0);
  const auto of_sphere_at = [](float x_m) {
    shader::FrameParams params{};
    params.counts.x() = 1;
    params.sphere << x_m, 0, 0.2f, 0.2f;
    params.lamps[0].position_radius << 0, 0, 1.2f, 0.05f;
    params.lamps[0].intensity << 1, 1, 1, 0;
    params.lamps[0].facing.setZero();
    return params;
  };
  Model hand;
  hand.positions_m = {{-0.05f, -0.05f, 0.7f}, {0.05f, -0.05f, 0.7f}, {0, 0.05f, 0.7f}};
  hand.indices = {0, 1, 2};
  const auto recorded = [&](LampMaps& maps, float x_m) {
    shader::FrameParams params = of_sphere_at(x_m);
    maps.choose(*device_, params, &hand);
    const auto list = device_->begin();
    maps.record(*list, objects, false, store.white());
    device_->submit(*list);
    EXPECT_FALSE(maps.moved_anew());
    return gpu::values_of<float>(device_->download(*maps.bindings()[0].texture));
  };
  LampMaps first(*device_, 64, 4, 1), other(*device_, 64, 4, 1);
  const std::vector<float> before = recorded(first, 0), after = recorded(first, 0.04f);
  const auto half = before.begin() + static_cast<std::ptrdiff_t>(before.size() / 2);
  EXPECT_GT(std::count_if(half, before.end(), [](float depth) { return depth < 1; }), 20);
  EXPECT_NE(before, after);
  EXPECT_EQ(after, recorded(other, 0.04f));
}

ON_BOTH_DEVICES(LampMapsTest);

}  // namespace
}  // namespace lumigraft::relight
