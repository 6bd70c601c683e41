#include "server/pipeline/pipeline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <mutex>
#include <thread>

#include "capture/error.h"
#include "capture/live/device_clock.h"
#include "capture/recorded/image_source.h"
#include "capture/recorded/seekable_reader.h"
#include "tests/relight/gpu/lost_device/lose.h"

namespace lumigraft::server {
namespace {

using namespace std::chrono_literals;

ServiceInput tabletop(const relight::Plan& plan) {
  ServiceFiles files;
  files.session = LUMIGRAFT_SOURCE_DIR "/recordings/tabletop";
  return read_service(files, plan);
}

/// Without a GPU.
ServiceInput tabletop_by_rays() {
  relight::Plan plan;
  plan.method = "rays";
  plan.trace_scale = 8;
  return tabletop(plan);
}

/// A recording's frames of one stream, delivered like those of a live camera, twenty times a second.
class AsLive : public capture::Source {
 public:
  explicit AsLive(std::shared_ptr<capture::Source> recorded) : recorded_(std::move(recorded)) {}
  std::optional<capture::SourceItem> next(std::chrono::milliseconds timeout) override {
    const auto now = std::chrono::steady_clock::now();
    std::this_thread::sleep_until(std::min(due_, now + timeout));
    if (std::chrono::steady_clock::now() < due_) return std::nullopt;
    std::optional<capture::SourceItem> item = recorded_->next(timeout);
    if (!item) {
      recorded_->rewind();
      item = recorded_->next(timeout);
    }
    due_ = std::max(due_ + 50ms, now);
    const std::int64_t now_ns = capture::steady_now_ns();
    std::visit([&](auto& any) { any.stamp = {now_ns, now_ns, sequence_++}; }, *item);
    return item;
  }
  bool finished() const override { return false; }
  void rewind() override {}

 private:
  std::shared_ptr<capture::Source> recorded_;
  std::chrono::steady_clock::time_point due_ = std::chrono::steady_clock::now();
  std::uint64_t sequence_ = 0;
};

class Away : public capture::Source {
 public:
  std::optional<capture::SourceItem> next(std::chrono::milliseconds timeout) override {
    std::this_thread::sleep_for(timeout);
    return std::nullopt;
  }
  bool finished() const override { return false; }
  void rewind() override {}
  std::string fault() const override { return "colour: the camera is disconnected"; }
};

/// Whether the light stage processes further fish-eye frames.
bool light_goes_on(Metrics& metrics) {
  constexpr std::uint64_t kFramesToSee = 4;
  const auto deadline = std::chrono::steady_clock::now() + 10s;
  metrics.take_interval();
  std::uint64_t frames = 0;
  while (frames < kFramesToSee && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(20ms);
    frames += metrics.take_interval().stages["light"].count;
  }
  return frames >= kFramesToSee;
}

TEST(Pipeline, LightGoesOnWhileTheColourCameraIsAway) {
  relight::Plan plan;
  plan.method = "rays";  // needs no GPU
  const ServiceInput input = tabletop(plan);
  const auto open = [&]() -> Pipeline::Cameras {
    capture::PairedSources sources = capture::open_sources(input.session);
    sources.live = true;
    sources.color = sources.depth = std::make_shared<Away>();
    sources.fisheye = std::make_shared<AsLive>(sources.fisheye);
    std::unique_ptr<capture::FisheyeReader> fisheye = capture::read_fisheye_apart(sources);
    return {std::make_unique<capture::PairingReader>(std::move(sources)), std::move(fisheye)};
  };
  EncoderDemand demand;
  Metrics metrics;
  Pipeline pipeline(
      input, open(), open, [] { return nullptr; }, demand, metrics, [](const auto&) {});
  pipeline.start();
  std::this_thread::sleep_for(300ms);
  EXPECT_TRUE(light_goes_on(metrics));
  EXPECT_EQ(metrics.frames(), 0u) << "nothing was drawn";
  EXPECT_EQ(pipeline.newest_record().warnings, std::vector<std::string>{"colour: the camera is disconnected"});
}

/// Bytes of fused bricks once the pipeline has some; 0 if it fuses nothing.
std::size_t fused_bytes(const Metrics& metrics) {
  const std::string name = "\nlumigraft_fusion_bytes ";
  const auto deadline = std::chrono::steady_clock::now() + 60s;
  while (std::chrono::steady_clock::now() < deadline) {
    const std::string text = metrics.prometheus();
    const std::size_t at = text.find(name);
    if (at != std::string::npos && text[at + name.size()] != '0') return std::stoull(text.substr(at + name.size()));
    std::this_thread::sleep_for(10ms);
  }
  return 0;
}

TEST(Pipeline, MemoryOfTheFieldIsSet) {
  ServiceInput input = tabletop_by_rays();
  input.exhibit = {};
  input.server.fusion.max_memory_mb = 1;
  const auto open = [&]() -> Pipeline::Cameras {
    return {capture::seekable_frames(capture::open_sources(input.session)), nullptr};
  };
  EncoderDemand demand;
  Metrics metrics;
  Pipeline pipeline(
      input, open(), open, [] { return nullptr; }, demand, metrics, [](const auto&) {});
  pipeline.start();
  const std::size_t bytes = fused_bytes(metrics);
  EXPECT_GT(bytes, 0u);
  EXPECT_LE(bytes, 1'020'000u);
}

/// Whether a frame's warnings contain the text soon.
bool warns(const Pipeline& pipeline, const std::string& text) {
  const auto deadline = std::chrono::steady_clock::now() + 60s;
  while (std::chrono::steady_clock::now() < deadline) {
    const std::vector<std::string> lines = pipeline.newest_record().warnings;
    if (std::ranges::any_of(lines, [&](const auto& line) { return line.find(text) != std::string::npos; })) return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

// Two models that take their time: of one the page reads how much is done while frames go on, the other is broken.
TEST(Pipeline, FramesGoOnWhileModelsAreLoaded) {
  ServiceInput input = tabletop_by_rays();
  const std::shared_ptr<const relight::Model> model = std::exchange(input.exhibit.objects[0].model, nullptr);
  std::promise<void> may_end;
  const auto slow = [model, ended = may_end.get_future().share()](const relight::LoadProgress& progress) {
    progress(0.4f);
    ended.wait();
    return [model](relight::VirtualObject& object) { object.model = model; };
  };
  const auto broken = [](const relight::LoadProgress&) -> relight::GiveModel {
    throw capture::InputError("exhibit.toml: found nothing");
  };
  input.unloaded = {{0, "owl", slow}, {0, "vase", broken}};
  const auto open = [&]() -> Pipeline::Cameras {
    return {capture::seekable_frames(capture::open_sources(input.session)), nullptr};
  };
  EncoderDemand demand;
  Metrics metrics;
  Pipeline pipeline(
      input, open(), open, [] { return nullptr; }, demand, metrics, [](const auto&) {});
  pipeline.start();
  EXPECT_TRUE(warns(pipeline, "object \"owl\" is being loaded: 40 %"));
  const std::uint64_t frames = metrics.frames();
  const auto deadline = std::chrono::steady_clock::now() + 60s;
  while (metrics.frames() < frames + 3 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(10ms);
  EXPECT_GE(metrics.frames(), frames + 3);
  EXPECT_EQ(pipeline.exhibit().models_given(), 0u);
  may_end.set_value();
  EXPECT_TRUE(warns(pipeline, "object \"vase\" is left out: exhibit.toml: found nothing"));
  EXPECT_EQ(pipeline.exhibit().newest()->objects[0].model, model);
}

TEST(Pipeline, LightGoesOnWhileDrawingIsSlow) {
  constexpr relight::gpu::Backend kBackend = relight::gpu::Backend::egl;
  const relight::gpu::LosableDevices losable(kBackend);
  relight::Plan plan;
  plan.volume = 32;
  plan.rsm = 64;
  plan.trace_scale = 4;
  plan.user_set = {"method"};
  const ServiceInput input = tabletop(plan);
  const auto open = [&]() -> Pipeline::Cameras {
    return {capture::seekable_frames(capture::open_sources(input.session)), nullptr};
  };
  std::promise<void> goes_on;
  const std::shared_future<void> resumed = goes_on.get_future();
  std::atomic<bool> waits = false;
  const auto make_device = [&, made = 0]() mutable {
    if (made++ > 0) {
      waits = true;
      resumed.wait();
    }
    return relight::gpu::create_device(kBackend, {});
  };
  EncoderDemand demand;
  Metrics metrics;
  Pipeline pipeline(input, open(), open, make_device, demand, metrics, [](const auto&) {});
  pipeline.start();
  const auto deadline = std::chrono::steady_clock::now() + 60s;
  while (metrics.frames() == 0 && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(10ms);
  losable.lose();
  while (!waits && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(10ms);
  EXPECT_TRUE(waits) << "for the device that it draws with";
  std::this_thread::sleep_for(300ms);  // work in progress ends
  const std::uint64_t frames = metrics.frames();
  EXPECT_TRUE(light_goes_on(metrics));
  EXPECT_EQ(metrics.frames(), frames) << "nothing was drawn";
  goes_on.set_value();
}

}  // namespace
}  // namespace lumigraft::server
