#include "server/pipeline/live_relighter.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/pipeline/parameters.h"
#include "tests/relight/gpu/lost_device/lose.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

/// A device of which every use fails.
class BrokenDevice : public relight::gpu::Device {
 public:
  std::string name() const override { return "broken"; }
  bool is_software() const override { return true; }
  const relight::gpu::Holdings& holdings() const override { return holdings_; }
  std::unique_ptr<relight::gpu::Texture> create_texture(const relight::gpu::TextureDesc&) override { fail(); }
  std::unique_ptr<relight::gpu::Buffer> create_buffer(std::size_t, std::string_view) override { fail(); }
  std::unique_ptr<relight::gpu::ComputePipeline> create_compute(std::string_view) override { fail(); }
  std::unique_ptr<relight::gpu::RasterPipeline> create_raster(const relight::gpu::RasterDesc&) override { fail(); }
  void upload(const relight::gpu::Texture&, int, std::span<const std::byte>) override { fail(); }
  void upload_rgb(const relight::gpu::Texture&, std::span<const std::uint8_t>) override { fail(); }
  void upload(const relight::gpu::Buffer&, std::size_t, std::span<const std::byte>) override { fail(); }
  std::vector<std::byte> download(const relight::gpu::Texture&, int) override { fail(); }
  std::vector<std::byte> download(const relight::gpu::Buffer&) override { fail(); }
  std::vector<std::vector<std::byte>> download(std::span<const relight::gpu::TexturePart>) override { fail(); }
  std::unique_ptr<relight::gpu::CommandList> begin() override { fail(); }
  std::vector<relight::gpu::PassTime> submit(relight::gpu::CommandList&) override { fail(); }

 private:
  [[noreturn]] static void fail() { throw relight::gpu::GpuError("device lost"); }
  relight::gpu::Holdings holdings_;
};

/// Works until a switch that all its copies share is set.
class FailingDevice : public relight::gpu::Device {
 public:
  FailingDevice(std::unique_ptr<relight::gpu::Device> real, std::shared_ptr<bool> broken)
      : real_(std::move(real)), broken_(std::move(broken)) {}
  std::string name() const override { return real_->name(); }
  bool is_software() const override { return real_->is_software(); }
  const relight::gpu::Holdings& holdings() const override { return real_->holdings(); }
  std::unique_ptr<relight::gpu::Texture> create_texture(const relight::gpu::TextureDesc& d) override {
    return ok().create_texture(d);
  }
  std::unique_ptr<relight::gpu::Buffer> create_buffer(std::size_t s, std::string_view n) override {
    return ok().create_buffer(s, n);
  }
  std::unique_ptr<relight::gpu::ComputePipeline> create_compute(std::string_view s) override {
    return ok().create_compute(s);
  }
  std::unique_ptr<relight::gpu::RasterPipeline> create_raster(const relight::gpu::RasterDesc& d) override {
    return ok().create_raster(d);
  }
  void upload(const relight::gpu::Texture& t, int m, std::span<const std::byte> b) override { ok().upload(t, m, b); }
  void upload_rgb(const relight::gpu::Texture& t, std::span<const std::uint8_t> b) override { ok().upload_rgb(t, b); }
  void upload(const relight::gpu::Buffer& t, std::size_t o, std::span<const std::byte> b) override {
    ok().upload(t, o, b);
  }
  std::vector<std::byte> download(const relight::gpu::Texture& t, int m) override { return ok().download(t, m); }
  std::vector<std::byte> download(const relight::gpu::Buffer& b) override { return ok().download(b); }
  std::vector<std::vector<std::byte>> download(std::span<const relight::gpu::TexturePart> p) override {
    return ok().download(p);
  }
  std::unique_ptr<relight::gpu::CommandList> begin() override { return ok().begin(); }
  std::vector<relight::gpu::PassTime> submit(relight::gpu::CommandList& list) override { return ok().submit(list); }

 private:
  relight::gpu::Device& ok() {
    if (*broken_) {
      throw relight::gpu::DeviceLost("device lost");
    }
    return *real_;
  }
  std::unique_ptr<relight::gpu::Device> real_;
  std::shared_ptr<bool> broken_;
};

capture::Session small_camera() {
  capture::Session session;
  session.color.model.width = 64;
  session.color.model.height = 48;
  session.color.model.fx = session.color.model.fy = 50;
  session.color.model.cx = 31.5;
  session.color.model.cy = 23.5;
  return session;
}

capture::FrameSet grey_frame() {
  auto color = std::make_shared<capture::Frame>();
  color->encoded = capture::Image<std::uint8_t>(64, 48, 3, 99);
  capture::FrameSet frame;
  frame.color = color;
  return frame;
}

/// Of cones, also for specular objects.
relight::Plan small_plan() {
  relight::Plan plan;
  plan.volume = 32;
  plan.user_set.insert("method");
  return plan;
}

reconstruct::Scene empty_room() {
  reconstruct::Scene scene;
  scene.pose.emplace();
  scene.pose->T_tag_camera.translation().z() = 1;
  scene.pose->T_tag_camera.linear() = Eigen::AngleAxisd(3.14159, Eigen::Vector3d::UnitX()).toRotationMatrix();
  scene.illumination = std::make_shared<reconstruct::Illumination>();
  scene.field = std::make_shared<reconstruct::DistanceField>();
  return scene;
}

relight::Exhibit pyramid() {
  const TinySession tiny("live-relighter");
  relight::Exhibit exhibit;
  exhibit.objects.emplace_back();
  exhibit.objects[0].model = relight::load_model(tiny.folder / "pyramid.obj", 'z');
  return exhibit;
}

/// The first frame with the objects: models are uploaded, and their light is gathered, over some frames.
LiveRelighter::Result drawn(LiveRelighter& relighter, const reconstruct::Scene& scene, const relight::Exhibit& exhibit,
                            const relight::Plan& plan) {
  // Shaders may be compiled meanwhile, which takes a slow machine minutes.
  const auto last = std::chrono::steady_clock::now() + std::chrono::minutes(5);
  LiveRelighter::Result result;
  do {
    result = relighter.relight(grey_frame(), scene, exhibit, plan);
  } while (result.picture.passed_through && std::chrono::steady_clock::now() < last);
  return result;
}

TEST(LiveRelighter, ADeviceThatCannotBeMadeIsAnErrorAtTheStart) {
  EXPECT_THROW(LiveRelighter(small_camera(), relight::Plan(),
                             []() -> std::shared_ptr<relight::gpu::Device> { throw relight::gpu::GpuError("none"); }),
               relight::gpu::GpuError);
  relight::Plan by_cones;
  by_cones.user_set = {"method"};
  EXPECT_THROW(LiveRelighter(small_camera(), by_cones, [] { return std::make_shared<BrokenDevice>(); }),
               relight::gpu::GpuError);
}

TEST(LiveRelighter, RaysNeedNoDeviceAndDrawWithWhatWasPrepared) {
  relight::Plan plan;
  plan.method = "rays";
  plan.trace_scale = 8;
  LiveRelighter relighter(small_camera(), plan,
                          []() -> std::shared_ptr<relight::gpu::Device> { throw relight::gpu::GpuError("none"); });
  ASSERT_TRUE(relighter.draws_prepared());
  reconstruct::Scene scene = empty_room();
  const relight::Exhibit exhibit = pyramid();
  EXPECT_TRUE(relighter.wants_prepared(scene));
  const auto unprepared = relighter.relight(grey_frame(), scene, exhibit, plan);
  EXPECT_TRUE(unprepared.picture.passed_through);
  ASSERT_EQ(unprepared.picture.warnings.size(), 1u);
  EXPECT_NE(unprepared.picture.warnings[0].find("is being prepared"), std::string::npos);
  EXPECT_TRUE(relighter.wants_models(exhibit));
  relighter.prepare_model(exhibit);
  EXPECT_FALSE(relighter.wants_models(exhibit));
  const auto early = relighter.relight(grey_frame(), scene, exhibit, plan);
  EXPECT_TRUE(early.picture.passed_through);
  EXPECT_FALSE(early.up_to_date);
  ASSERT_EQ(early.picture.warnings.size(), 1u);
  EXPECT_NE(early.picture.warnings[0].find("not ready for rays yet"), std::string::npos);

  relighter.prepare(scene);
  EXPECT_FALSE(relighter.wants_prepared(scene));
  const auto dark = relighter.relight(grey_frame(), scene, exhibit, plan);
  EXPECT_FALSE(dark.picture.passed_through);
  EXPECT_TRUE(dark.up_to_date);

  // Changes of light have effect at once, those of surfaces after `prepare`.
  auto light = std::make_shared<reconstruct::Illumination>();
  light->lights.emplace_back();
  light->lights[0].direction = Eigen::Vector3f(0.1f, 0.2f, 1).normalized();
  light->lights[0].irradiance.setConstant(3);
  scene.illumination = light;
  EXPECT_FALSE(relighter.wants_prepared(scene));
  auto lit = relighter.relight(grey_frame(), scene, exhibit, plan);
  for (int i = 0; i < 100 && !lit.picture.passes.empty(); ++i)
    lit = relighter.relight(grey_frame(), scene, exhibit, plan);
  EXPECT_GT(*std::max_element(lit.picture.srgb.data.begin(), lit.picture.srgb.data.end()),
            *std::max_element(dark.picture.srgb.data.begin(), dark.picture.srgb.data.end()) + 20);
  scene.field = std::make_shared<reconstruct::DistanceField>();
  EXPECT_TRUE(relighter.wants_prepared(scene));
  const auto behind = relighter.relight(grey_frame(), scene, exhibit, plan);
  EXPECT_FALSE(behind.up_to_date);
  EXPECT_EQ(behind.picture.srgb.data, lit.picture.srgb.data);
}

/// A frame of a room with things in it, at a time.
capture::FrameSet frame_at(std::int64_t time_ns, bool covered) {
  auto color = std::make_shared<capture::Frame>();
  color->encoded = capture::Image<std::uint8_t>(64, 48, 3, 3);
  for (std::size_t i = 0; !covered && i < color->encoded.data.size(); ++i)
    color->encoded.data[i] = i / 3 % 64 < 20 ? 40 : 160;
  capture::FrameSet frame;
  frame.time_ns = time_ns;
  frame.color = color;
  return frame;
}

int change_of(const LiveRelighter::Result& result, const capture::FrameSet& frame) {
  int worst = 0;
  for (std::size_t i = 0; i < result.picture.srgb.data.size(); ++i)
    worst = std::max(worst, std::abs(result.picture.srgb.data[i] - frame.color->encoded.data[i]));
  return worst;
}

// They do not vanish within one frame.
TEST(LiveRelighter, ObjectsFadeOutWhenThePoseIsLostAndWhenTheLensIsCovered) {
  relight::Plan plan;
  plan.method = "rays";
  plan.trace_scale = 8;
  constexpr std::int64_t kGap = 33'000'000;
  for (const bool covers : {false, true}) {
    SCOPED_TRACE(covers ? "covered" : "lost");
    LiveRelighter relighter(small_camera(), plan,
                            []() -> std::shared_ptr<relight::gpu::Device> { throw relight::gpu::GpuError("none"); });
    reconstruct::Scene scene = empty_room();
    scene.pose->from = reconstruct::Pose::From::surface;
    const relight::Exhibit exhibit = pyramid();
    relighter.prepare(scene);
    relighter.prepare_model(exhibit);
    std::int64_t time_ns = 1'000'000'000;
    const auto next = [&](bool missing) {
      const capture::FrameSet frame = frame_at(time_ns += kGap, missing && covers);
      if (missing && !covers) {
        scene.pose->from = reconstruct::Pose::From::past;
      } else {
        scene.pose->from = reconstruct::Pose::From::surface;
        scene.pose->time_ns = time_ns;
      }
      return change_of(relighter.relight(frame, scene, exhibit, plan), frame);
    };
    int full = 0;
    for (int i = 0; i < 20; ++i) full = next(false);
    ASSERT_GT(full, 60) << "a dark object on a bright room";
    int last = full, worst_step = 0;
    for (int i = 0; i < 20; ++i) {
      const int now = next(true);
      EXPECT_LE(now, last);
      worst_step = std::max(worst_step, last - now);
      last = now;
    }
    EXPECT_EQ(last, 0);
    if (!covers) {
      EXPECT_LT(worst_step, full / 2);
    }
    for (int i = 0; i < 20; ++i) {
      const int now = next(false);
      EXPECT_GE(now, last);
      EXPECT_LT(now - last, full / 3);
      last = now;
    }
    EXPECT_EQ(last, full);
  }
}

TEST(LiveRelighter, WhatWasHiddenBeforeIsNotFadedOutUnderACover) {
  relight::Plan plan;
  plan.method = "rays";
  plan.trace_scale = 8;
  LiveRelighter relighter(small_camera(), plan, [] { return std::shared_ptr<relight::gpu::Device>(); });
  reconstruct::Scene scene = empty_room();
  scene.pose->from = reconstruct::Pose::From::surface;
  relight::Exhibit exhibit = pyramid();
  relighter.prepare(scene);
  relighter.prepare_model(exhibit);
  std::int64_t time_ns = 1'000'000'000;
  const auto next = [&](const capture::FrameSet& frame) {
    scene.pose->time_ns = frame.time_ns;
    return change_of(relighter.relight(frame, scene, exhibit, plan), frame);
  };
  int change = 0;
  for (int i = 0; i < 20; ++i) change = next(frame_at(time_ns += 33'000'000, false));
  ASSERT_GT(change, 60);
  exhibit.objects[0].visible = false;
  EXPECT_EQ(next(frame_at(time_ns += 33'000'000, false)), 0);
  capture::FrameSet covered = frame_at(time_ns += 33'000'000, false);
  auto even = std::make_shared<capture::Frame>(*covered.color);
  std::fill(even->encoded.data.begin(), even->encoded.data.end(), std::uint8_t{200});
  covered.color = even;
  EXPECT_EQ(next(covered), 0);
}

class LiveRelighterOn : public testing::TestWithParam<relight::gpu::Backend> {};
INSTANTIATE_TEST_SUITE_P(BothDevices, LiveRelighterOn,
                         testing::Values(relight::gpu::Backend::vulkan, relight::gpu::Backend::egl),
                         [](const auto& test) { return std::string(relight::gpu::name_of(test.param)); });

TEST_P(LiveRelighterOn, ADeviceThatFailsIsMadeAgainAndThePictureGoesOn) {
  const auto broken = std::make_shared<bool>(false);
  int made = 0;
  LiveRelighter relighter(small_camera(), small_plan(), [&]() -> std::shared_ptr<relight::gpu::Device> {
    ++made;
    if (made == 2) {
      throw relight::gpu::GpuError("still gone");
    }
    return std::make_shared<FailingDevice>(relight::gpu::create_device(GetParam(), {}), broken);
  });
  const reconstruct::Scene scene = empty_room();
  const relight::Exhibit exhibit = pyramid();
  relighter.prepare_model(exhibit);
  *broken = true;
  const auto failed = relighter.relight(grey_frame(), scene, exhibit, small_plan());
  ASSERT_EQ(failed.picture.srgb.data, grey_frame().color->encoded.data);
  ASSERT_FALSE(failed.picture.warnings.empty());
  EXPECT_NE(failed.picture.warnings.back().find("device lost"), std::string::npos) << failed.picture.warnings.back();
  EXPECT_TRUE(failed.picture.passed_through);
  *broken = false;
  const auto begin = std::chrono::steady_clock::now();
  bool well = false;
  while (!well && std::chrono::steady_clock::now() - begin < std::chrono::seconds(10)) {
    const auto result = relighter.relight(grey_frame(), scene, exhibit, small_plan());
    ASSERT_EQ(result.picture.srgb.width, 64) << "there is a picture at all times";
    well = made == 3;
    for (const std::string& warning : result.picture.warnings) {
      EXPECT_FALSE(well && warning.find("GPU device failed") != std::string::npos) << warning;
    }
  }
  EXPECT_TRUE(well);
}

TEST_P(LiveRelighterOn, WithoutAGraphicsProcessorRaysDraw) {
  if (!relight::gpu::create_device(GetParam(), {})->is_software()) GTEST_SKIP() << "draws on a graphics processor";
  relight::Plan asked = small_plan();
  asked.user_set.clear();
  asked.trace_scale = 4;
  LiveRelighter relighter(small_camera(), asked, [] { return relight::gpu::create_device(GetParam(), {}); });
  ASSERT_TRUE(relighter.draws_prepared());
  const reconstruct::Scene scene = empty_room();
  const relight::Exhibit exhibit = pyramid();
  EXPECT_TRUE(relighter.relight(grey_frame(), scene, exhibit, asked).picture.passed_through);
  ASSERT_TRUE(relighter.wants_models(exhibit));
  relighter.prepare_model(exhibit);
  ASSERT_TRUE(relighter.wants_prepared(scene));
  relighter.prepare(scene);
  EXPECT_FALSE(relighter.wants_prepared(scene));
  const auto drawn_by_rays = relighter.relight(grey_frame(), scene, exhibit, asked);
  EXPECT_EQ(drawn_by_rays.picture.plan.method, "rays");
  EXPECT_EQ(drawn_by_rays.picture.plan.trace_scale, 8) << "the live setting of rays";
  EXPECT_FALSE(drawn_by_rays.picture.passed_through);
  asked.budget_ms = 33;
  EXPECT_EQ(relighter.relight(grey_frame(), scene, exhibit, asked).picture.plan.trace_scale, 16) << "the first step";

  LiveRelighter without_device(small_camera(), asked, [] { return nullptr; });
  EXPECT_TRUE(without_device.draws_prepared()) << "whoever makes devices knows that there is none but software";

  // What the user chose stays.
  relight::Plan chosen = asked;
  chosen.user_set.insert("method");
  LiveRelighter as_chosen(small_camera(), chosen, [] { return relight::gpu::create_device(GetParam(), {}); });
  as_chosen.prepare_model(exhibit);
  EXPECT_EQ(drawn(as_chosen, scene, exhibit, chosen).picture.plan.method, "dvct");
  EXPECT_FALSE(as_chosen.draws_prepared());
}

TEST_P(LiveRelighterOn, AfterALostDevicePicturesAreAsBefore) {
  const relight::gpu::LosableDevices losable(GetParam());
  LiveRelighter relighter(small_camera(), small_plan(), [] { return relight::gpu::create_device(GetParam(), {}); });
  const reconstruct::Scene scene = empty_room();
  const relight::Exhibit exhibit = pyramid();
  relighter.prepare_model(exhibit);
  const auto before = drawn(relighter, scene, exhibit, small_plan());
  ASSERT_FALSE(before.picture.passed_through);
  EXPECT_NE(before.picture.srgb.data, grey_frame().color->encoded.data);

  losable.lose();
  // An unchanged frame needs no device.
  EXPECT_EQ(relighter.relight(grey_frame(), scene, exhibit, small_plan()).picture.srgb.data, before.picture.srgb.data);
  relight::Exhibit moved = exhibit;
  moved.objects.front().position_m.x() += 0.05;
  const auto failed = relighter.relight(grey_frame(), scene, moved, small_plan());
  EXPECT_TRUE(failed.picture.passed_through);
  EXPECT_EQ(failed.picture.srgb.data, grey_frame().color->encoded.data);
  ASSERT_EQ(failed.picture.warnings.size(), 1u);
  EXPECT_NE(failed.picture.warnings[0].find("the GPU device failed and is created again: "), std::string::npos)
      << failed.picture.warnings[0];

  const auto after = drawn(relighter, scene, exhibit, small_plan());
  EXPECT_FALSE(after.picture.passed_through);
  EXPECT_EQ(after.picture.srgb.data, before.picture.srgb.data);
  EXPECT_EQ(after.picture.warnings, before.picture.warnings);
}

TEST_P(LiveRelighterOn, ADeviceThatHangsIsReplacedAFewTimes) {
  const relight::gpu::LosableDevices losable(GetParam());
  LiveRelighter relighter(small_camera(), small_plan(), [] {
    return relight::gpu::create_device(GetParam(), {.hangs_after = std::chrono::minutes(5)});
  });
  const reconstruct::Scene scene = empty_room();
  const relight::Exhibit exhibit = pyramid();
  relighter.prepare_model(exhibit);
  const auto before = drawn(relighter, scene, exhibit, small_plan());
  ASSERT_FALSE(before.picture.passed_through);
  relight::Exhibit moved = exhibit;
  moved.objects.front().position_m.x() += 0.05;
  for (int hangs = 1; hangs <= kPipeline.max_hangs; ++hangs) {
    losable.hang();
    const auto failed = relighter.relight(grey_frame(), scene, moved, small_plan());
    EXPECT_TRUE(failed.picture.passed_through);
    ASSERT_EQ(failed.picture.warnings.size(), 1u);
    EXPECT_NE(failed.picture.warnings[0].find(" hangs"), std::string::npos) << failed.picture.warnings[0];
    ASSERT_EQ(relighter.gave_up(), hangs == kPipeline.max_hangs);
    if (relighter.gave_up()) break;
    const auto after = drawn(relighter, scene, exhibit, small_plan());
    EXPECT_EQ(after.picture.srgb.data, before.picture.srgb.data);
    EXPECT_EQ(after.picture.warnings, before.picture.warnings);
  }
  const auto without = relighter.relight(grey_frame(), scene, moved, small_plan());
  EXPECT_EQ(without.picture.srgb.data, grey_frame().color->encoded.data);
  ASSERT_EQ(without.picture.warnings.size(), 1u);
  EXPECT_NE(without.picture.warnings[0].find("has hung too often"), std::string::npos) << without.picture.warnings[0];
}

}  // namespace
}  // namespace lumigraft::server
