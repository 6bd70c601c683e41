// The live setting takes short cuts for the picture's sake: each stands beside what it stands in for.
#include <algorithm>
#include <cmath>

#include "closed_scene.h"

namespace lumigraft::test {
namespace {

/// A bright ball beside its lamp over a grey floor: it lights the floor well outside its shadow.
ClosedScene bright_ball() {
  ClosedScene scene;
  scene.width = 192;
  scene.height = 144;
  scene.focal_px = 160;
  scene.sky = 0.1f;
  scene.radiance = [](const Eigen::Vector3f& p) { return 0.15f + 0.1f * p.x() * p.x(); };
  scene.lamps = {lamp_at({0.15f, 0.05f, 0.35f}, 0.02f, 0.1f)};
  scene.exhibit.objects = {sphere_object(0.12f, {-0.1f, 0, 0.15f}, 0.9f)};
  return scene;
}

Plan live_plan() {
  Plan plan = careful_plan(64);
  plan.trace_scale = 4;
  return plan;
}

struct Difference {
  double rms_codes = 0;
  int worst_codes = 0, changed = 0;  ///< the latter: values of the first that are not those of `unchanged`
};

Difference difference(const Image<std::uint8_t>& a, const Image<std::uint8_t>& b,
                      const Image<std::uint8_t>& unchanged) {
  Difference d;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    const int codes = std::abs(a.data[i] - b.data[i]);
    d.worst_codes = std::max(d.worst_codes, codes);
    d.rms_codes += codes * codes;
    d.changed += std::abs(a.data[i] - unchanged.data[i]) > 1;
  }
  d.rms_codes = std::sqrt(d.rms_codes / static_cast<double>(a.data.size()));
  return d;
}

class ClosedLive : public ClosedTest {
 protected:
  static Image<std::uint8_t> camera_picture(ClosedScene scene) {
    scene.exhibit.objects.clear();
    return relit(scene, live_plan()).srgb;
  }
};

// Without maps, light that changes smoothly is worked out for one pixel of 4 × 4; with maps, for each.
TEST_F(ClosedLive, OnePixelOfSixteenStandsForTheSmoothOnes) {
  const ClosedScene scene = bright_ball();
  Relighter relighter(device_, scene.session());
  const auto every = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, live_plan(), true).srgb;
  const auto some = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, live_plan()).srgb;
  const Difference d = difference(some, every, camera_picture(scene));
  RecordProperty("rms_codes", std::to_string(d.rms_codes));
  EXPECT_GT(d.changed, 192 * 144 / 2);  // of three times as many values
  EXPECT_LT(d.rms_codes, 0.14);
  EXPECT_LE(d.worst_codes, 3);
}

// Gathered once a cell of 2³ voxels, and traced for each pixel with several times the cones.
TEST_F(ClosedLive, CellsStandForTracedPixels) {
  const ClosedScene scene = bright_ball();
  Relighter relighter(device_, scene.session());
  const auto live = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, live_plan()).srgb;
  const auto traced = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, careful_plan(64)).srgb;
  const Difference d = difference(live, traced, camera_picture(scene));
  RecordProperty("rms_codes", std::to_string(d.rms_codes));
  EXPECT_LT(d.rms_codes, 0.8);
}

}  // namespace
}  // namespace lumigraft::test
