// Objects that appear and disappear while a service runs: nothing that takes long is done for one frame. Each picture
// in the end is compared with that of a new relighter, which gathers everything at once.
#include <algorithm>
#include <cmath>

#include "relight/parameters.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

class ClosedAppearing : public ClosedTest {
 protected:
  ClosedAppearing() {
    scene_.exhibit.objects.front().name = "box";
    scene_.exhibit.objects.push_back(sphere_object(0.06f, {0.25f, 0.1f, 0.08f}, 0.7f));
    scene_.exhibit.objects.back().name = "ball";
    scene_.exhibit.objects.back().visible = false;
  }
  void prepare() {
    while (models_->wants(scene_.exhibit)) models_->prepare_next(scene_.exhibit);
  }
  relight::RelitPicture next() {
    frame_.time_ns += gap_ns_;
    return relighter_.relight(frame_, room_, scene_.exhibit, live_plan());
  }
  /// The first frame with all objects, after their models were uploaded.
  relight::RelitPicture first_with_all() {
    relight::RelitPicture picture;
    for (int i = 0; i < 20 && (i == 0 || !picture.warnings.empty()); ++i) {
      picture = next();
      EXPECT_EQ(gathered(picture), 0);
    }
    return picture;
  }
  /// Until everything has been gathered and faded in.
  relight::RelitPicture settle(int* frames) {
    int resting = 0;  // a frame may have had time for work of the processor only
    for (*frames = 0; *frames < 2000; ++*frames) {
      relight::RelitPicture picture = next();
      resting = picture.passes.empty() && picture.warnings.empty() ? resting + 1 : 0;
      if (resting == 3) return picture;
    }
    return {};
  }
  capture::Image<std::uint8_t> at_once() const {
    return relight::Relighter(device_, scene_.session()).relight(frame_, room_, scene_.exhibit, live_plan()).srgb;
  }
  /// Passes that gather indirect light.
  static int gathered(const relight::RelitPicture& picture) {
    return static_cast<int>(std::ranges::count_if(picture.passes, [](const relight::gpu::PassTime& pass) {
      return pass.name == "volumes" || pass.name == "inject" || pass.name == "resolve" || pass.name == "cells" ||
             pass.name.starts_with("bounce");
    }));
  }
  static int unlike(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b) {
    if (a.data.size() != b.data.size()) return 255;
    int worst = 0;
    for (std::size_t i = 0; i < a.data.size(); ++i) worst = std::max(worst, std::abs(a.data[i] - b.data[i]));
    return worst;
  }

  static double rms_codes(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - b.data[i], 2);
    return std::sqrt(sum / static_cast<double>(a.data.size()));
  }

  ClosedScene scene_ = box_on_floor();
  capture::FrameSet frame_ = scene_.frame();
  std::int64_t gap_ns_ = 100'000'000;  ///< between frames; with 0 each has one step
  const reconstruct::Scene room_ = scene_.scene();
  std::shared_ptr<relight::UploadModels> models_ = std::make_shared<relight::UploadModels>(relight::make_upload_model);
  relight::Relighter relighter_{device_, scene_.session(), models_};
};

// The schedule does not depend on the device.
INSTANTIATE_TEST_SUITE_P(On, ClosedAppearing, testing::Values(relight::gpu::Backend::vulkan));

TEST_P(ClosedAppearing, AnObjectIsNotDrawnBeforeItsModelIsPrepared) {
  const relight::RelitPicture early = next();
  EXPECT_TRUE(early.passed_through);
  ASSERT_EQ(early.warnings.size(), 1u);
  EXPECT_NE(early.warnings[0].find("\"box\" is being prepared"), std::string::npos) << early.warnings[0];
  scene_.exhibit.objects.back().visible = true;
  models_->prepare_next(scene_.exhibit);
  bool drawn = false;
  for (int i = 0; i < 500 && !drawn; ++i) {
    const relight::RelitPicture one = next();
    drawn = !one.passed_through;
    ASSERT_FALSE(one.warnings.empty());
    if (drawn) {
      EXPECT_NE(one.warnings[0].find("\"ball\" is being prepared"), std::string::npos) << one.warnings[0];
    }
  }
  EXPECT_TRUE(drawn);
}

TEST_P(ClosedAppearing, AnObjectIsShownAtOnceAndItsIndirectLightArrivesOverFrames) {
  prepare();
  int frames = 0;
  const capture::Image<std::uint8_t> before = settle(&frames).srgb;
  EXPECT_EQ(unlike(before, at_once()), 0);
  scene_.exhibit.objects.back().visible = true;
  const relight::RelitPicture first = first_with_all();
  EXPECT_FALSE(first.passed_through);
  EXPECT_GT(unlike(first.srgb, before), 20) << "it is there";
  const capture::Image<std::uint8_t> wanted = at_once();
  EXPECT_GT(unlike(first.srgb, wanted), 1) << "nothing is left to gather: this test tests nothing";
  gap_ns_ = 0;
  capture::Image<std::uint8_t> last = first.srgb;
  int most = 0, all = 0, resting = 0;
  double step = 0;
  for (frames = 0; frames < 2000 && resting < 3; ++frames) {
    const relight::RelitPicture picture = next();
    resting = picture.passes.empty() ? resting + 1 : 0;
    const int now = gathered(picture);
    all += now;
    most = std::max(most, now);
    // Shadows of lamps follow within receiver_frames.
    if (frames > 8) step = std::max(step, rms_codes(picture.srgb, last));
    last = picture.srgb;
  }
  EXPECT_GT(all, 20);
  EXPECT_LT(most, all / 3);
  EXPECT_LT(step, 1.0) << "RMS of pixel values, of one frame to the next";
  EXPECT_EQ(unlike(last, wanted), 0);
}

TEST_P(ClosedAppearing, AnObjectIsGoneAtOnceAndItsIndirectLightFadesOverFrames) {
  prepare();
  scene_.exhibit.objects.back().visible = true;
  int frames = 0;
  ASSERT_FALSE(settle(&frames).srgb.empty());
  scene_.exhibit.objects.back().visible = false;
  EXPECT_EQ(gathered(next()), 0);
  const capture::Image<std::uint8_t> wanted = at_once();
  EXPECT_LT(unlike(next().srgb, wanted), 60) << "the object is still there";
  EXPECT_EQ(unlike(settle(&frames).srgb, wanted), 0);
  EXPECT_GT(frames, relight::kRelight.round_frames);
}

TEST_P(ClosedAppearing, AGlossyObjectIsGatheredOverFramesToo) {
  prepare();
  int frames = 0;
  ASSERT_FALSE(settle(&frames).srgb.empty());
  scene_.exhibit.objects.back().material.metallic = 1;
  scene_.exhibit.objects.back().material.roughness = 0.4f;
  scene_.exhibit.objects.back().material.specular = 1;
  scene_.exhibit.objects.back().visible = true;
  EXPECT_FALSE(first_with_all().passed_through);
  EXPECT_EQ(unlike(settle(&frames).srgb, at_once()), 0);
}

}  // namespace
}  // namespace lumigraft::test
