// Animated objects with rays, against the same pose as a rigid model.
#include "relight/gather/irradiance_probes.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/bending_bar.h"

namespace lumigraft::test {
namespace {

// Probes are those of the bar at rest; on the rigid model they are placed anew.
TEST(RaysAnimated, EveryFrameShowsThePoseOfItsTime) {
  const ClosedScene scene = bar_on_floor();
  const reconstruct::Scene room = scene.scene();
  const capture::FrameSet frame = scene.frame();
  relight::RayRenderer renderer(scene.session());
  const capture::Image<std::uint8_t> straight =
      renderer.relight(at(frame, 0), room, scene.exhibit, rays_plan(2, 40)).srgb;
  for (const double time_s : {0.5, 1.0}) {
    relight::RayRenderer once(scene.session()), other(scene.session());
    const capture::Image<std::uint8_t> wanted =
        other.relight(frame, room, rigid(scene.exhibit, time_s), rays_plan(2, 40)).srgb;
    const capture::Image<std::uint8_t> bent =
        once.relight(at(frame, time_s), room, scene.exhibit, rays_plan(2, 40)).srgb;
    EXPECT_LT(rms_of_codes(bent, wanted), 0.7) << time_s;
    EXPECT_LT(rms_of_codes(renderer.relight(at(frame, time_s), room, scene.exhibit, rays_plan(2, 40)).srgb, wanted), 1)
        << "light that was gathered in another pose goes on, at " << time_s;
    EXPECT_GT(rms_of_codes(bent, straight), 2) << "it moves";
  }
}

TEST(RaysAnimated, APoseThatIsHeldIsNotTracedAgain) {
  const ClosedScene scene = bar_on_floor();
  const reconstruct::Scene room = scene.scene();
  const capture::FrameSet frame = scene.frame();
  relight::RayRenderer renderer(scene.session());
  const relight::RelitPicture ended = renderer.relight(at(frame, 1), room, scene.exhibit, rays_plan());
  const relight::RelitPicture later = renderer.relight(at(frame, 2), room, scene.exhibit, rays_plan());
  EXPECT_FALSE(ended.passes.empty());
  EXPECT_TRUE(later.passes.empty());
  EXPECT_EQ(later.srgb.data, ended.srgb.data);
}

TEST(RaysAnimated, AnotherRunGivesTheSameBytes) {
  const ClosedScene scene = bar_on_floor();
  const reconstruct::Scene room = scene.scene();
  const capture::FrameSet frame = scene.frame();
  std::vector<std::vector<std::uint8_t>> first;
  for (int run = 0; run < 2; ++run) {
    relight::RayRenderer renderer(scene.session());
    for (std::size_t i = 0; i < 3; ++i) {
      const auto bytes =
          renderer.relight(at(frame, 0.3 * static_cast<double>(i)), room, scene.exhibit, rays_plan()).srgb.data;
      if (run == 0)
        first.push_back(bytes);
      else
        EXPECT_EQ(bytes, first[i]) << i;
    }
  }
}

TEST(RaysAnimated, ProbesStayOnTheirPlacesOfTheSurface) {
  const ClosedScene scene = bar_on_floor();
  const relight::VirtualObject& bar = scene.exhibit.objects[0];
  const auto at_rest = relight::make_ray_model(bar.model);
  relight::PosedTrees trees;
  const auto bent = relight::posed_probes(*at_rest, bar.pose(1), trees);
  ASSERT_EQ(bent->places.size(), at_rest->places.size());
  EXPECT_EQ(bent->interpolation, at_rest->interpolation);
  int turned = 0;
  for (std::size_t i = 0; i < bent->places.size(); ++i) {
    const Eigen::Vector3f& p = at_rest->places[i].position_m;
    if (p.z() < 0.07f) {
      EXPECT_LT((bent->places[i].position_m - p).norm(), 1e-5f);
    } else if (p.z() > 0.13f) {  // turned about y by a quarter, around (0, 0, 0.1)
      EXPECT_LT((bent->places[i].position_m - Eigen::Vector3f(p.z() - 0.1f, p.y(), 0.1f - p.x())).norm(), 1e-5f);
      const Eigen::Vector3f& n = at_rest->places[i].normal;
      EXPECT_LT((bent->places[i].normal - Eigen::Vector3f(n.z(), n.y(), -n.x())).norm(), 1e-4f);
      ++turned;
    }
  }
  EXPECT_GT(turned, 20);
}

TEST(RaysAnimated, ATreeThatNothingUsesIsFittedToTheNextPose) {
  const ClosedScene scene = bar_on_floor();
  const relight::VirtualObject& bar = scene.exhibit.objects[0];
  const auto at_rest = relight::make_ray_model(bar.model);
  relight::PosedTrees trees;
  const relight::ModelTree* first = relight::posed_probes(*at_rest, bar.pose(0.2), trees)->tree.get();
  const auto bent = relight::posed_probes(*at_rest, bar.pose(1), trees);
  EXPECT_EQ(bent->tree.get(), first);
  EXPECT_NE(relight::posed_probes(*at_rest, bar.pose(0.5), trees)->tree.get(), first) << "it is in use";
  std::vector<relight::ReferenceMesh> mesh(1);
  mesh[0].model = bent->model;
  const relight::Meshes fitted(mesh, {bent->tree}), built(mesh, nullptr);
  int hits = 0;
  for (int i = 0; i < 400; ++i) {
    const float x = static_cast<float>(i % 20) / 50 - 0.1f, y = static_cast<float>(i) / 5000 - 0.04f;
    const auto found = fitted.hit({x, y, 1}, -Eigen::Vector3f::UnitZ(), 10),
               expected = built.hit({x, y, 1}, -Eigen::Vector3f::UnitZ(), 10);
    ASSERT_EQ(found.has_value(), expected.has_value()) << x << " " << y;
    if (!found) continue;
    EXPECT_NEAR(found->t_m, expected->t_m, 1e-5f);
    ++hits;
  }
  EXPECT_GT(hits, 100);
}

}  // namespace
}  // namespace lumigraft::test
