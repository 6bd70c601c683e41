// Live pictures by rays: those that wait for their light are those of rays; those that do not show the last light where
// camera and objects are now.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <thread>

#include "relight/views/live_ray_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Picture = capture::Image<std::uint8_t>;

double rms_codes(const Picture& a, const Picture& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - b.data[i], 2);
  return std::sqrt(sum / static_cast<double>(a.data.size()));
}

class LiveRays : public testing::Test {
 protected:
  LiveRays() : scene_(box_on_floor()), models_(std::make_shared<relight::RayModels>(relight::make_ray_model)) {
    while (models_->wants(scene_.exhibit)) models_->prepare_next(scene_.exhibit);
    renderer_ = std::make_unique<relight::LiveRayRenderer>(scene_.session(), models_);
    room_ = scene_.scene();
    frame_ = scene_.frame();
    renderer_->take(renderer_->room_of(room_));
  }

  /// A frame of the scene as it is now. Its light takes longer than a budget of `budget_ms`; 0: it is waited for.
  Picture live(int budget_ms) {
    relight::Plan plan = rays_plan(8);
    plan.budget_ms = budget_ms;
    plan.user_set = {"trace_scale", "rays"};
    frame_.index = ++index_;
    const relight::RelitPicture picture = renderer_->relight(frame_, room_, scene_.exhibit, plan);
    EXPECT_FALSE(picture.passed_through);
    changed_ = !picture.passes.empty();
    reprojected_ = std::ranges::any_of(picture.passes, [](const auto& pass) { return pass.name == "reproject room"; });
    return picture.srgb;
  }
  /// What rays find for it anew.
  Picture fresh() const {
    relight::RayRenderer renderer(scene_.session());
    return renderer.relight(frame_, room_, scene_.exhibit, rays_plan(8)).srgb;
  }
  /// Until the light of a still scene does not change any more.
  Picture settled() {
    Picture last;
    for (int k = 0, same = 0; k < 100 && same < 20; ++k) {  // not every frame is drawn anew
      Picture next = live(0);
      same = next.data == last.data ? same + 1 : 0;
      last = std::move(next);
    }
    return last;
  }
  void move_camera(float x_m) {
    scene_.eye_m.x() += x_m;
    frame_ = scene_.frame();
    room_.pose->T_tag_camera = scene_.T_tag_camera();
  }
  void turn_object(double degrees) {
    scene_.exhibit.objects.front().rotation =
        Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitZ());
  }

  static constexpr int kTooShort_ms = 1;
  ClosedScene scene_;
  std::shared_ptr<relight::RayModels> models_;
  std::unique_ptr<relight::LiveRayRenderer> renderer_;
  reconstruct::Scene room_;
  capture::FrameSet frame_;
  std::uint64_t index_ = 0;
  bool changed_ = false, reprojected_ = false;  ///< the last picture
};

TEST_F(LiveRays, PicturesThatWaitAreThoseOfRays) {
  const Picture still = settled();
  EXPECT_LT(rms_codes(still, fresh()), 0.5);
}

TEST_F(LiveRays, ACameraThatMovesSeesTheLastLightInItsPlace) {
  const Picture before = settled();
  move_camera(0.15f);
  const Picture reprojected = live(kTooShort_ms), wanted = fresh();
  const double moved = rms_codes(before, wanted);
  EXPECT_TRUE(reprojected_) << "its light was found within a millisecond";
  EXPECT_GT(moved, 2.5) << "the test needs another view";
  EXPECT_LT(rms_codes(reprojected, wanted), 0.4 * moved);
  EXPECT_LT(rms_codes(settled(), wanted), 0.5) << "and its own once it rests";
}

TEST_F(LiveRays, LightOfANewViewIsFoundThoughNoPictureWaitsForIt) {
  settled();
  move_camera(0.15f);
  Picture last = live(kTooShort_ms);
  EXPECT_TRUE(reprojected_);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);  // longer than any machine takes
  while (reprojected_ && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    last = live(kTooShort_ms);
    if (!changed_) reprojected_ = true;  // nothing new was drawn
  }
  EXPECT_FALSE(reprojected_);
  EXPECT_LT(rms_codes(last, fresh()), 1);
}

TEST_F(LiveRays, AnObjectThatTurnsIsShownWhereItIs) {
  const Picture before = settled();
  turn_object(20);
  const Picture reprojected = live(kTooShort_ms), wanted = fresh();
  const double moved = rms_codes(before, wanted);
  EXPECT_TRUE(reprojected_);
  EXPECT_GT(moved, 2);
  EXPECT_LT(rms_codes(reprojected, wanted), 0.5 * moved) << "its shadow is late";
  EXPECT_LT(rms_codes(settled(), wanted), 0.7);
}

TEST_F(LiveRays, AnObjectThatAppearsIsThereAtOnce) {
  const Picture before = settled();
  relight::VirtualObject other = scene_.exhibit.objects.front();
  other.name = "other";
  other.position_m.x() += 0.25;
  scene_.exhibit.objects.push_back(other);
  const Picture with_both = live(kTooShort_ms), wanted = fresh();
  EXPECT_LT(rms_codes(with_both, wanted), 0.5 * rms_codes(before, wanted));
  scene_.exhibit.objects.erase(scene_.exhibit.objects.begin());
  const Picture with_other = fresh();
  EXPECT_LT(rms_codes(live(kTooShort_ms), with_other), 0.5 * rms_codes(with_both, with_other)) << "and gone";
}

TEST_F(LiveRays, WithoutARoomThePicturePassesThrough) {
  relight::LiveRayRenderer renderer(scene_.session(), models_);
  const relight::RelitPicture picture = renderer.relight(frame_, room_, scene_.exhibit, rays_plan(8));
  EXPECT_TRUE(picture.passed_through);
  ASSERT_FALSE(picture.warnings.empty());
  EXPECT_NE(picture.warnings[0].find("not ready"), std::string::npos) << picture.warnings[0];
}

}  // namespace
}  // namespace lumigraft::test
