// A strip of the floor with missing data, as in the shadow of a depth sensor's projector or at grazing angles: its
// light changes as on the floor next to it.
#include <cmath>

#include "reconstruct/room/enclosure.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr float kStripHalf_m = 0.016f;  // about 7 pixels wide; more than a voxel away from fused data

ClosedScene ball_before_lamp() {
  ClosedScene scene;
  scene.width = 240;
  scene.height = 180;
  scene.focal_px = 200;
  scene.eye_m = {0, -0.6f, 0.6f};
  scene.sky = 0.1f;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.15f; };
  scene.lamps = {lamp_at({0.5f, 0.05f, 0.5f}, 0.02f, 0.3f)};
  scene.exhibit.objects = {sphere_object(0.08f, {0.05f, 0, 0.1f}, 0.5f)};
  return scene;
}

/// A strip across the shadow, which falls to the left of the ball.
bool in_strip(const Eigen::Vector3f& p) { return std::abs(p.x() + 0.12f) < kStripHalf_m; }

capture::FrameSet without_strip(const ClosedScene& scene) {
  capture::FrameSet frame = scene.frame();
  auto depth = std::make_shared<capture::DepthFrame>(*frame.depth);
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      if (in_strip(scene.on_plane(u, v))) depth->depth_m.at(u, v) = 0;
    }
  }
  frame.depth = depth;
  return frame;
}

/// Removes the colour in the strip, and its surface too unless `fused`.
reconstruct::Scene unknown_strip(const ClosedScene& closed, bool fused) {
  reconstruct::Scene scene = closed.scene();
  auto field = std::make_shared<reconstruct::DistanceField>(*scene.field);
  auto colors = std::make_shared<reconstruct::AlbedoField>(*scene.albedo);
  for (const auto& [key, shared] : scene.field->bricks) {
    auto brick = std::make_shared<reconstruct::FieldBrick>(*shared);
    reconstruct::BrickColor& color = brick->own_color();
    auto paint = std::make_shared<reconstruct::AlbedoBrick>(*colors->bricks.at(key));
    for (int i = 0; i < reconstruct::kBrickVoxels; ++i) {
      const Eigen::Vector3i voxel(8 * key[0] + i % 8, 8 * key[1] + i / 8 % 8, 8 * key[2] + i / 64);
      if (!in_strip(field->voxel_m * voxel.cast<float>())) continue;
      const auto k = static_cast<std::size_t>(i);
      if (!fused) brick->weight[k] = 0;
      color.weight[k] = 0;
      color.radiance[k].setZero();
      paint->sigma[k] = -1;
    }
    field->bricks[key] = brick;
    colors->bricks[key] = paint;
  }
  scene.field = field;
  scene.albedo = colors;
  return scene;
}

/// The sides of a room around a table, whose floor is seen through the strip.
std::shared_ptr<const reconstruct::Enclosure> room_around() {
  return std::make_shared<const reconstruct::Enclosure>(reconstruct::Enclosure{{{{0, 0, 1}, 0.4f, true},
                                                                                {{0, 0, -1}, 2, true},
                                                                                {{1, 0, 0}, 1.5f, true},
                                                                                {{-1, 0, 0}, 1.5f, true},
                                                                                {{0, 1, 0}, 1.5f, true},
                                                                                {{0, -1, 0}, 1.5f, true}},
                                                                               Eigen::Vector3f(0, 0, 0.3f)});
}

/// RMS error of the strip's light relative to its change; `make(session)` creates a renderer.
template <typename Make>
double strip_error(const Make& make, const relight::Plan& plan, bool fused,
                   std::shared_ptr<const reconstruct::Enclosure> enclosure = nullptr) {
  const ClosedScene closed = ball_before_lamp();
  const capture::Session session = closed.session();
  const auto relit = [&](const capture::FrameSet& frame, reconstruct::Scene scene, const relight::Exhibit& exhibit) {
    scene.enclosure = enclosure;
    return make(session)->relight(frame, scene, exhibit, plan, true);
  };
  const relight::RelitPicture complete = relit(closed.frame(), closed.scene(), closed.exhibit);
  const relight::RelitPicture holed = relit(without_strip(closed), unknown_strip(closed, fused), closed.exhibit);
  const relight::RelitPicture unchanged = relit(closed.frame(), closed.scene(), {});
  double off = 0, change = 0;
  for (int v = 0; v < closed.height; ++v) {
    for (int u = 0; u < closed.width; ++u) {
      const Eigen::Vector3f p = closed.on_plane(u, v);
      if (!in_strip(p) || std::abs(p.y()) > 0.15f || complete.maps->mask.at(u, v) > 0) continue;
      const double there = picture_radiance(complete, u, v);
      off += std::pow(picture_radiance(holed, u, v) - there, 2);
      change += std::pow(picture_radiance(unchanged, u, v) - there, 2);
    }
  }
  return std::sqrt(off / change);  // 1 where nothing changes
}

class ClosedHole : public ClosedTest {
 protected:
  double error(const relight::Plan& plan, bool fused) const {
    return strip_error([&](const capture::Session& s) { return std::make_unique<relight::Relighter>(device_, s); },
                       plan, fused);
  }
};
ON_BOTH_DEVICES(ClosedHole);

TEST_P(ClosedHole, NeitherDepthNorAnythingFused) { EXPECT_LT(error(careful_plan(), false), 0.3); }

TEST_P(ClosedHole, NoColorWhereLightIsInCells) {
  relight::Plan plan = careful_plan();
  plan.trace_scale = 2;
  plan.cells = 1;
  EXPECT_LT(error(plan, true), 0.15);
}

TEST_P(ClosedHole, NoColorLive) {
  relight::Plan plan = careful_plan();
  plan.trace_scale = 4;
  EXPECT_LT(error(plan, true), 0.15);
}

TEST(RaysHole, ColourOrSurfaceUnknown) {
  relight::Plan plan = careful_plan();
  plan.method = "rays";
  for (const bool fused : {false, true}) {
    EXPECT_LT(
        strip_error([](const capture::Session& s) { return std::make_unique<relight::RayRenderer>(s); }, plan, fused),
        0.3)
        << fused;
  }
}

// Through the hole of the fused surface a ray meets the modelled sides of the room, which are darker than the picture.
TEST(RaysHole, BeforeTheEnclosure) {
  relight::Plan plan = careful_plan();
  plan.method = "rays";
  EXPECT_LT(strip_error([](const capture::Session& s) { return std::make_unique<relight::RayRenderer>(s); }, plan,
                        /*fused=*/false, room_around()),
            0.3);
}

}  // namespace
}  // namespace lumigraft::test
