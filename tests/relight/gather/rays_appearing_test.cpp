// Objects that appear while a service runs: their models are prepared elsewhere, and their light arrives over frames.
#include <algorithm>
#include <cmath>

#include "relight/gather/ray_objects.h"
#include "relight/views/live_ray_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

double rms_of(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - b.data[i], 2);
  return std::sqrt(sum / static_cast<double>(a.data.size()));
}

TEST(RaysAppearing, AnObjectIsNotDrawnBeforeItsModelIsPreparedAndThenItsLightArrivesOverFrames) {
  ClosedScene scene = box_on_floor();
  const auto models = std::make_shared<relight::RayModels>(relight::make_ray_model);
  const reconstruct::Scene room = scene.scene();
  const capture::FrameSet frame = scene.frame();
  const relight::Plan live = rays_plan(8, 20, 4);
  relight::LiveRayRenderer renderer(scene.session(), models);
  renderer.take(renderer.room_of(room));
  const relight::RelitPicture early = renderer.relight(frame, room, scene.exhibit, live);
  EXPECT_TRUE(early.passed_through);
  ASSERT_EQ(early.warnings.size(), 1u);
  EXPECT_NE(early.warnings[0].find("is being prepared"), std::string::npos) << early.warnings[0];
  ASSERT_TRUE(models->wants(scene.exhibit));
  models->prepare_next(scene.exhibit);
  EXPECT_FALSE(models->wants(scene.exhibit));

  relight::RayRenderer at_once(scene.session());
  const capture::Image<std::uint8_t> wanted = at_once.relight(frame, room, scene.exhibit, live).srgb;
  const relight::RelitPicture first = renderer.relight(frame, room, scene.exhibit, live);
  EXPECT_FALSE(first.passed_through);
  const double begun = rms_of(first.srgb, wanted), nothing = rms_of(early.srgb, wanted);
  EXPECT_GT(begun, 0.3) << "all was gathered for one frame";
  EXPECT_LT(begun, 0.5 * nothing) << "light of lamps and its shadow are there";
  capture::Image<std::uint8_t> last = first.srgb;
  double step = 0;
  int frames = 0;
  for (; frames < 200; ++frames) {
    const relight::RelitPicture picture = renderer.relight(frame, room, scene.exhibit, live);
    if (picture.passes.empty()) break;
    step = std::max(step, rms_of(picture.srgb, last));
    last = picture.srgb;
  }
  EXPECT_GT(frames, 7);
  EXPECT_LT(step, 0.7 * begun) << "no jump";
  EXPECT_LT(rms_of(last, wanted), 0.5);
}

TEST(RaysAppearing, NewProbesBeginWithTheEnvironmentThatNothingOccludes) {
  const ClosedScene scene = box_on_floor();
  const auto probes = relight::make_ray_model(scene.exhibit.objects.front().model);
  relight::PlacedModel placed;
  placed.model = scene.exhibit.objects.front().model;
  placed.at_rest = placed.places = probes;
  placed.facets = std::make_shared<const std::vector<relight::ObjectFacet>>(relight::find_facets(*probes, {}));
  relight::RayObjects objects({placed});
  ASSERT_FALSE(objects.all_have_light());
  reconstruct::Sh9 sky = reconstruct::zero_sh();
  sky[0].setConstant(2);
  sky[2].setConstant(0.5f);
  objects.begin_with(sky);
  EXPECT_TRUE(objects.all_have_light());
  for (std::size_t i = 0; i < objects.places().size(); ++i) {
    const Eigen::Vector3f all = reconstruct::sh_irradiance(sky, objects.places()[i].normal);
    EXPECT_NEAR(objects.indirect()[i][1], all.y(), 1e-5f);
  }
}

}  // namespace
}  // namespace lumigraft::test
