// Device time of a frame and of its passes at 1280×720, for cones and propagation with small and large volumes and
// maps, and the error of the picture. The room is as estimated.
//
//   build/release/device_time SESSION [vulkan|egl] [busy] [SETTING...]
//
// Kinds of frames: "turning": every object turns by 1°, indirect light is amortized where the setting does so;
// "complete": by 20°, so that everything is computed anew; "camera": only the camera moves.
//
// A device that rests between frames lowers its clock, by up to a sixth of the highest. `busy` keeps it busy between
// the commands of a frame, so that pass times are those of the highest clock; wall times are then useless.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <map>
#include <mutex>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/bench/bench_session.h"
#include "server/bench/resize.h"
#include "server/bench/setting_run.h"
#include "server/pipeline/make_renderer.h"
#include "tests/bench/comparators/thesis_plan.h"

namespace lumigraft::relight::gpu {
// Generated from tests/bench/device_time.
std::span<const ShaderCode> device_time_shaders();
}  // namespace lumigraft::relight::gpu

namespace lumigraft::test {
namespace {

namespace gpu = relight::gpu;
constexpr int kRound = 24, kFrames = 8, kWarm = 3;  ///< frames of an amortized update; others measured, and before
constexpr int kHeight = 360, kEnlarged = 2;         ///< rows of the session's 640×480 that are kept
constexpr double kDegree = std::numbers::pi / 180, kStep_m = 0.002;
constexpr int kBusyGroups = 528;

/// Used by turns by the frames' commands, which go first, and by those that keep the device busy.
class Turns {
 public:
  template <typename Use>
  auto first(const Use& use) {
    ++waiting_;
    const std::lock_guard lock(mutex_);
    --waiting_;
    return use();
  }
  template <typename Use>
  void last(const Use& use) {
    while (waiting_ > 0) std::this_thread::yield();
    const std::lock_guard lock(mutex_);
    use();
  }

 private:
  std::mutex mutex_;
  std::atomic<int> waiting_ = 0;
};

/// A device whose lists are executed while nothing else keeps the hardware busy.
class TimedDevice : public gpu::Device {
 public:
  TimedDevice(std::unique_ptr<gpu::Device> real, Turns& turns) : real_(std::move(real)), turns_(turns) {}
  std::string name() const override { return real_->name(); }
  bool is_software() const override { return real_->is_software(); }
  const gpu::Holdings& holdings() const override { return real_->holdings(); }
  std::unique_ptr<gpu::Texture> create_texture(const gpu::TextureDesc& d) override { return real_->create_texture(d); }
  std::unique_ptr<gpu::Buffer> create_buffer(std::size_t bytes, std::string_view name) override {
    return real_->create_buffer(bytes, name);
  }
  std::unique_ptr<gpu::ComputePipeline> create_compute(std::string_view s) override { return real_->create_compute(s); }
  std::unique_ptr<gpu::RasterPipeline> create_raster(const gpu::RasterDesc& d) override {
    return real_->create_raster(d);
  }
  void upload(const gpu::Texture& t, int mip, std::span<const std::byte> b) override { real_->upload(t, mip, b); }
  void upload_rgb(const gpu::Texture& t, std::span<const std::uint8_t> b) override { real_->upload_rgb(t, b); }
  void upload(const gpu::Buffer& t, std::size_t at, std::span<const std::byte> b) override { real_->upload(t, at, b); }
  std::vector<std::byte> download(const gpu::Texture& t, int mip) override { return real_->download(t, mip); }
  std::vector<std::byte> download(const gpu::Buffer& b) override { return real_->download(b); }
  std::vector<std::vector<std::byte>> download(std::span<const gpu::TexturePart> p) override {
    return real_->download(p);
  }
  std::unique_ptr<gpu::CommandList> begin() override { return real_->begin(); }
  std::vector<gpu::PassTime> submit(gpu::CommandList& list) override {
    return turns_.first([&] { return real_->submit(list); });
  }

 private:
  std::unique_ptr<gpu::Device> real_;
  Turns& turns_;
};

/// Keeps the hardware busy, by a device of its own.
void keep_busy(const std::stop_token& stop, Turns& turns) {
  const auto device = gpu::create_device(gpu::Backend::vulkan, {.more_shaders = gpu::device_time_shaders()});
  const auto pipeline = device->create_compute("busy.comp");
  const auto sink = device->create_buffer(sizeof(float), "sink");
  const gpu::Binding bindings[] = {gpu::storage(1, *sink)};
  while (!stop.stop_requested()) {
    turns.last([&] {
      const auto list = device->begin();
      list->dispatch(*pipeline, bindings, {}, kBusyGroups);
      device->submit(*list);
    });
  }
}

struct Setting {
  std::string name;
  relight::Plan plan;
};

Setting setting(const std::string& method, const std::string& traced, int volume, int rsm) {
  Setting s{method + "-" + traced + "-" + std::to_string(volume) + "-" + std::to_string(rsm), {}};
  if (traced == "thesis") s.plan = comparators::thesis_plan(1);
  s.plan.method = method;
  s.plan.volume = volume;
  s.plan.rsm = rsm;
  s.plan.adaptive = 0;
  s.plan.trace_scale = traced == "live" ? 4 : traced == "thesis" ? 1 : 2;
  return s;
}

std::vector<Setting> settings() {
  return {setting("dvct", "live", 64, 128),   setting("dvct", "live", 256, 1024),   setting("dvct", "half", 64, 256),
          setting("dvct", "half", 256, 1024), setting("dvct", "thesis", 256, 1024), setting("dlpv", "live", 64, 128),
          setting("dlpv", "live", 64, 1024),  setting("dlpv", "half", 64, 1024)};
}

template <typename T>
capture::Image<T> rows_of(const capture::Image<T>& from, int first) {
  if (from.empty()) return from;
  capture::Image<T> part(from.width, kHeight, from.channels);
  const auto row = static_cast<std::size_t>(from.width) * static_cast<std::size_t>(from.channels);
  std::copy_n(from.data.begin() + static_cast<std::ptrdiff_t>(row * static_cast<std::size_t>(first)), part.data.size(),
              part.data.begin());
  return part;
}

/// Row at which the picture's part around the objects begins.
int first_row(const capture::Image<float>& coverage) {
  double sum = 1e-6, rows = 0;
  for (int v = 0; v < coverage.height; ++v) {
    for (int u = 0; u < coverage.width; ++u) {
      sum += coverage.at(u, v, 0);
      rows += coverage.at(u, v, 0) * v;
    }
  }
  return std::clamp(static_cast<int>(rows / sum) - kHeight / 2, 0, coverage.height - kHeight);
}

/// Keeps kHeight rows of the picture.
void crop(server::BenchScene& scene, capture::CameraModel& camera) {
  const int first = first_row(scene.truth.coverage);
  camera.height = kHeight;
  camera.cy -= first;
  auto color = std::make_shared<capture::Frame>(*scene.frame.color);
  color->encoded = rows_of(color->encoded, first);
  color->radiance = rows_of(color->radiance, first);
  scene.frame.color = std::move(color);
  if (scene.frame.depth) {
    auto depth = std::make_shared<capture::DepthFrame>(*scene.frame.depth);
    depth->depth_m = rows_of(depth->depth_m, first);
    scene.frame.depth = std::move(depth);
  }
  scene.frame.color_vignetting = nullptr;
  scene.camera = rows_of(scene.camera, first);
  for (auto* picture : {&scene.truth.background, &scene.truth.augmented, &scene.truth.coverage}) {
    *picture = rows_of(*picture, first);
  }
}

class Costs {
 public:
  void add(const reconstruct::StageCost& host, const std::vector<gpu::PassTime>& times) {
    for (const gpu::PassTime& pass : times) {
      if (passes_.try_emplace(pass.name, 0).second) order_.push_back(pass.name);
      passes_[pass.name] += pass.gpu_ms;
    }
    double sum = 0;
    for (const gpu::PassTime& pass : times) sum += pass.gpu_ms;
    gpu_ms_.push_back(sum);
    wall_ms_ += host.wall_ms;
    cpu_ms_ += host.cpu_ms;
  }

  void print(const std::string& name, const char* kind, const server::Measures& measures) const {
    const auto frames = static_cast<double>(gpu_ms_.size());
    double sum = 0;
    for (const double ms : gpu_ms_) sum += ms;
    std::printf("%-21s %-8s gpu_ms %7.3f, most %7.3f  wall_ms %6.1f  cpu_ms %6.1f  relight_error %.4f object %.4f\n",
                name.c_str(), kind, sum / frames, *std::max_element(gpu_ms_.begin(), gpu_ms_.end()), wall_ms_ / frames,
                cpu_ms_ / frames, measures.relight_error, measures.object_error);
    for (const std::string& pass : order_) std::printf("    %-20s %8.4f\n", pass.c_str(), passes_.at(pass) / frames);
    std::fflush(stdout);
  }

 private:
  std::vector<double> gpu_ms_;
  double wall_ms_ = 0, cpu_ms_ = 0;
  std::map<std::string, double> passes_;
  std::vector<std::string> order_;  ///< of passes
};

void measure(const server::ServiceInput& input, const capture::Session& session, const server::BenchScene& scene,
             const std::shared_ptr<gpu::Device>& device, const Setting& s) {
  const std::unique_ptr<relight::Renderer> renderer = server::make_renderer(session, s.plan, {}, device);
  const auto frame = [&](double turn_rad, double move_m) {
    reconstruct::Scene now = scene.scene;
    now.pose->T_tag_camera.translate(Eigen::Vector3d(move_m, 0, 0));
    return renderer->relight(scene.frame, now, server::turned(input.exhibit, turn_rad), s.plan);
  };
  const relight::RelitPicture first = frame(0, 0);
  for (const std::string& warning : first.warnings) std::printf("    %s\n", warning.c_str());
  const server::Measures measures =
      server::measure_picture(server::shrunk(first.srgb, kEnlarged), scene.camera, scene.truth);
  const auto run = [&](const char* kind, int before, int count, const auto& relit) {
    Costs costs;
    for (int i = 0; i < before + count; ++i) {
      const reconstruct::CostClock clock;
      const relight::RelitPicture picture = relit(i);
      if (i >= before) costs.add(clock.elapsed(), picture.passes);
    }
    costs.print(s.name, kind, measures);
  };
  if (s.plan.in_cells()) run("turning", kRound + 1, kRound, [&](int i) { return frame(i * kDegree, 0); });
  run("complete", kWarm, kFrames, [&](int i) { return frame(20 * i * kDegree, 0); });
  run("camera", kWarm, kFrames, [&](int i) { return frame(0, i * kStep_m); });
}

int run(const std::string& folder, std::vector<std::string> words) {
  const auto take = [&](const char* word) { return std::erase(words, word) > 0; };
  const gpu::Backend backend = take("egl")      ? gpu::Backend::egl
                               : take("vulkan") ? gpu::Backend::vulkan
                                                : gpu::best_backend();
  const bool busy = take("busy");
  const server::ServiceInput input = server::open_bench_session(folder, {});
  server::BenchScene scene = server::learn_bench_scene(input.session, {}, {});
  capture::Session session = input.session;
  crop(scene, session.color.model);
  server::resize_picture(kEnlarged, session.color.model, scene.frame);
  Turns turns;
  const auto device = std::make_shared<TimedDevice>(gpu::create_device(backend, {}), turns);
  std::jthread other;
  if (busy) other = std::jthread([&](const std::stop_token& stop) { keep_busy(stop, turns); });
  std::printf("%s, %s, %d x %d\n", device->name().c_str(), std::string(gpu::name_of(backend)).c_str(),
              session.color.model.width, session.color.model.height);
  for (const Setting& s : settings()) {
    if (words.empty() || std::find(words.begin(), words.end(), s.name) != words.end()) {
      measure(input, session, scene, device, s);
    }
  }
  return 0;
}

}  // namespace
}  // namespace lumigraft::test

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "Usage: device_time SESSION [vulkan|egl] [busy] [SETTING...]\n");
    return 2;
  }
  return lumigraft::test::run(argv[1], {argv + 2, argv + argc});
}
