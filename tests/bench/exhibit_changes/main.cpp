// Cost of frames after objects appear, disappear or are new, as `serve` renders them: the worst frame of the second
// that follows, over the median of those before.
//
//   build/release/exhibit_changes SESSION [METHOD...]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "capture/source.h"
#include "reconstruct/scene_builder.h"
#include "relight/gpu/backends.h"
#include "relight/planner.h"
#include "server/pipeline/background_threads.h"
#include "server/pipeline/exhibit_state.h"
#include "server/pipeline/live_relighter.h"
#include "server/pipeline/service_config.h"

namespace lumigraft::test {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kSettle = 60, kBefore = 24, kAfter = 120;  ///< frames
constexpr auto kFrame = std::chrono::milliseconds(33);

struct Seen {
  capture::FrameSet frame;
  reconstruct::Scene scene;
};

std::vector<Seen> frames_of(const capture::Session& session) {
  const auto frames = capture::open_paired_frames(session);
  reconstruct::SceneBuilder builder(session, {});
  std::vector<Seen> seen;
  while (const std::optional<capture::FrameSet> frame = frames->next(std::chrono::seconds(10))) {
    reconstruct::BuildResult built = builder.build(*frame);
    seen.push_back({std::move(built.frame), std::move(built.scene)});
  }
  for (Seen& s : seen) {  // the room as it is known in the end: no frame pays for news of it
    const auto pose = s.scene.pose;
    s.scene = seen.back().scene;
    s.scene.pose = pose;
  }
  return seen;
}

/// A ball with waves, 10 cm high, of 2 n² triangles.
relight::VirtualObject wavy_ball(const char* name, int n, const relight::Material& material) {
  auto model = std::make_shared<relight::Model>();
  const auto point = [&](int i, int j) {
    const double a = std::numbers::pi * i / n, b = 2 * std::numbers::pi * j / n;
    const double r = 0.045 + 0.004 * std::sin(9 * a) * std::sin(7 * b);
    return (r * Eigen::Vector3d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a))).eval();
  };
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      model->positions_m.push_back((point(i, j) + Eigen::Vector3d(0, 0, 0.05)).cast<float>());
      model->normals.push_back(point(i, j).normalized().cast<float>());
      model->texcoords.emplace_back(0, 0);
      model->colors.emplace_back(1, 1, 1);
    }
  }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i * (n + 1) + j); };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      if (i > 0) model->indices.insert(model->indices.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + 1 < n) model->indices.insert(model->indices.end(), {at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
    }
  }
  relight::Model::Part part;
  part.material = material;
  part.index_count = static_cast<std::uint32_t>(model->indices.size());
  model->parts.push_back(part);
  relight::VirtualObject object;
  object.name = name;
  object.model = std::move(model);
  return object;
}

class Film {
 public:
  Film(const capture::Session& session, const relight::Plan& plan, const std::vector<Seen>& seen, bool moving,
       relight::Exhibit first)
      : seen_(seen),
        moving_(moving),
        planner_(plan),
        relighter_(session, plan, [] { return relight::gpu::create_device(relight::gpu::Backend::best, {}); }),
        exhibit(std::move(first)) {
    if (relighter_.draws_prepared()) relighter_.prepare(seen.back().scene);
    models_ = std::jthread([this](const std::stop_token& stop) {
      server::BackgroundThreads background;
      background.add();
      while (!stop.stop_requested()) {
        const std::shared_ptr<const relight::Exhibit> now = wanted_.load();
        if (relighter_.wants_models(*now))
          relighter_.prepare_model(*now);
        else
          std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    });
  }

  struct Cost {
    double wall_ms, cpu_ms;
    std::string worst_pass;
    bool ready;  ///< drawn with all objects
  };
  std::vector<Cost> play(int frames) {
    std::vector<Cost> costs;
    for (int i = 0; i < frames; ++i) {
      std::this_thread::sleep_until(due_);
      due_ = std::max(due_ + kFrame, Clock::now());
      const int n = static_cast<int>(seen_.size());
      const int at = moving_ ? std::abs(n - 1 - number_ % (2 * n - 2)) : n - 1;
      Seen s = seen_[static_cast<std::size_t>(at)];
      s.frame.index = static_cast<std::uint64_t>(number_);
      s.frame.time_ns = number_++ * std::chrono::nanoseconds(kFrame).count();
      if (i == 0) wanted_ = std::make_shared<const relight::Exhibit>(exhibit);
      const reconstruct::CostClock clock;
      const double time_s = 1e-9 * static_cast<double>(s.frame.time_ns);
      const relight::Exhibit shown = server::shown_exhibit(exhibit, s.scene, time_s, standing_);
      const auto decision = planner_.decide(s.scene, shown, time_s);
      const auto result = relighter_.relight(s.frame, s.scene, shown, decision.plan);
      const reconstruct::StageCost cost = clock.elapsed();
      const auto worst = std::max_element(result.picture.passes.begin(), result.picture.passes.end(),
                                          [](const auto& a, const auto& b) { return a.gpu_ms < b.gpu_ms; });
      costs.push_back({cost.wall_ms, cost.cpu_ms,
                       worst == result.picture.passes.end() ? "" : worst->name + " " + std::to_string(worst->gpu_ms),
                       std::ranges::none_of(result.picture.warnings, [](const std::string& line) {
                         return line.find("being") != std::string::npos;
                       })});
    }
    return costs;
  }

  void change(const char* what, const std::function<void(relight::Exhibit&)>& act) {
    for (int i = 0; i < 20 && !play(kSettle / 2).back().ready; ++i) {
    }
    play(kSettle);
    const std::vector<Cost> before = play(kBefore);
    act(exhibit);
    const std::vector<Cost> after = play(kAfter);
    const auto median = [&](double Cost::*value) {
      std::vector<double> values;
      for (const Cost& c : before) values.push_back(c.*value);
      std::nth_element(values.begin(), values.begin() + kBefore / 2, values.end());
      return values[kBefore / 2];
    };
    const auto worst = [&](double Cost::*value) {
      return std::max_element(after.begin(), after.end(),
                              [&](const Cost& a, const Cost& b) { return a.*value < b.*value; });
    };
    const double wall = median(&Cost::wall_ms), cpu = median(&Cost::cpu_ms);
    const auto slow = worst(&Cost::wall_ms), busy = worst(&Cost::cpu_ms);
    std::printf("  %-22s wall %6.1f -> %7.1f ms (x %5.1f, frame %2d), CPU %6.1f -> %7.1f ms (x %5.1f)  %s\n", what,
                wall, slow->wall_ms, slow->wall_ms / wall, static_cast<int>(slow - after.begin()), cpu, busy->cpu_ms,
                busy->cpu_ms / cpu, slow->worst_pass.c_str());
    std::fflush(stdout);
  }

 private:
  const std::vector<Seen>& seen_;
  bool moving_;
  relight::Planner planner_;
  relight::Standing standing_;
  server::LiveRelighter relighter_;
  Clock::time_point due_ = Clock::now();
  int number_ = 0;

 public:
  relight::Exhibit exhibit;

 private:
  std::atomic<std::shared_ptr<const relight::Exhibit>> wanted_ = std::make_shared<const relight::Exhibit>();
  std::jthread models_;
};

void measure(const server::ServiceInput& input, const relight::Plan& plan, const std::vector<Seen>& seen, bool moving) {
  std::printf("%s, %s camera\n", plan.method.c_str(), moving ? "moving" : "still");
  Film film(input.session, plan, seen, moving, input.exhibit);
  const std::size_t own = film.exhibit.objects.size();
  film.change("hide the session's", [&](relight::Exhibit& e) {
    for (std::size_t i = 0; i < own; ++i) e.objects[i].visible = false;
  });
  film.change("show the session's", [&](relight::Exhibit& e) {
    for (std::size_t i = 0; i < own; ++i) e.objects[i].visible = true;
  });
  relight::VirtualObject large = wavy_ball("large", 160, {.specular = 0});
  large.position_m = {-0.12, 0.2, 0};
  film.change("add 50k triangles", [&](relight::Exhibit& e) { e.objects.push_back(large); });
  film.change("hide them", [&](relight::Exhibit& e) { e.objects[own].visible = false; });
  film.change("show them", [&](relight::Exhibit& e) { e.objects[own].visible = true; });
  film.change("remove them", [&](relight::Exhibit& e) { e.objects.pop_back(); });
  relight::VirtualObject glossy = wavy_ball("glossy", 60, {.metallic = 1, .roughness = 0.3f});
  glossy.position_m = {-0.12, 0.2, 0};
  film.change("add a glossy one", [&](relight::Exhibit& e) { e.objects.push_back(glossy); });
  film.change("hide it", [&](relight::Exhibit& e) { e.objects[own].visible = false; });
  film.change("show it", [&](relight::Exhibit& e) { e.objects[own].visible = true; });
}

}  // namespace
}  // namespace lumigraft::test

int main(int count, char** arguments) {
  using namespace lumigraft;
  if (count < 2) {
    std::fprintf(stderr, "usage: exhibit_changes SESSION [METHOD...]\n");
    return 2;
  }
  std::vector<std::string> methods(arguments + 2, arguments + count);
  if (methods.empty()) methods = {"dvct", "rays", "dlpv"};
  const server::ServiceInput input = server::read_service(
      {.config = {}, .session = arguments[1], .exhibit = {}, .overrides = {}}, server::interactive_plan());
  const std::vector<test::Seen> seen = test::frames_of(input.session);
  for (const std::string& method : methods) {
    relight::Plan plan = input.plan;
    plan.method = method;
    plan.user_set.insert("method");
    if (method == "rays") plan.trace_scale = 8;
    for (const bool moving : {false, true}) test::measure(input, plan, seen, moving);
  }
}
