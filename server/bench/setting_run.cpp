#include "server/bench/setting_run.h"

#include <algorithm>
#include <functional>
#include <numbers>
#include <utility>

#include "relight/amortized_light_update.h"
#include "relight/planner.h"
#include "server/bench/resize.h"

namespace lumigraft::server {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kMaxFrames = 5;
constexpr double kEnough_ms = 1000;  ///< time limit for measuring one cost

/// Mean cost over frames; `frame` renders the i-th. Measures at least `min_frames` frames, because the cost of
/// amortized updates differs from frame to frame.
FrameCost measure_cost(bool hardware, int min_frames, const std::function<relight::RelitPicture(int)>& frame) {
  reconstruct::StageCost sum{0, 0};
  std::vector<relight::gpu::PassTime> passes;
  int frames = 0;
  for (; frames < min_frames || (frames < kMaxFrames && sum.wall_ms < kEnough_ms); ++frames) {
    const reconstruct::CostClock clock;
    const relight::RelitPicture picture = frame(frames);
    const reconstruct::StageCost cost = clock.elapsed();
    sum.wall_ms += cost.wall_ms;
    sum.cpu_ms += cost.cpu_ms;
    for (const relight::gpu::PassTime& pass : picture.passes) {
      const auto known = std::ranges::find(passes, pass.name, &relight::gpu::PassTime::name);
      if (known == passes.end()) {
        passes.push_back(pass);
      } else {
        known->gpu_ms += pass.gpu_ms;
      }
    }
  }
  double gpu_ms = 0;
  for (relight::gpu::PassTime& pass : passes) gpu_ms += pass.gpu_ms /= frames;
  FrameCost result{{sum.wall_ms / frames, sum.cpu_ms / frames}, std::nullopt, std::move(passes)};
  if (hardware) result.gpu_ms = gpu_ms;
  return result;
}

/// With amortized light updates for moving objects: measures one whole cycle, after a first cycle in which no blending
/// takes place yet.
FrameCost measure_moving(bool hardware, const relight::Plan& plan,
                         const std::function<relight::RelitPicture(int)>& frame) {
  const reconstruct::CostClock clock;
  frame(0);
  // Emissive objects and sharp mirrors need all light gathered in every frame.
  const bool slow = clock.elapsed().wall_ms > kEnough_ms;
  const int round = plan.in_cells() && !slow ? relight::kRelight.round_frames : 0;
  for (int i = 1; i <= round; ++i) frame(i);
  return measure_cost(hardware, std::max(round, 1), [&](int i) { return frame(round + 1 + i); });
}

}  // namespace

relight::Exhibit turned(const relight::Exhibit& exhibit, double angle_rad) {
  relight::Exhibit result = exhibit;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()));
  for (relight::VirtualObject& object : result.objects) {
    object.rotation = turn * object.rotation;
    for (relight::KeyFrame& key : object.motion) key.rotation = turn * key.rotation;
  }
  return result;
}

FrameCost cost_of_turning(relight::Renderer& renderer, const capture::FrameSet& frame, const reconstruct::Scene& scene,
                          const relight::Exhibit& exhibit, const relight::Plan& plan, bool hardware) {
  return measure_moving(hardware, plan,
                        [&](int i) { return renderer.relight(frame, scene, turned(exhibit, i * kDegree), plan); });
}

BenchRun run_setting(relight::Renderer& renderer, const BenchScene& scene, const relight::Exhibit& exhibit,
                     const relight::Plan& plan, bool hardware) {
  relight::Planner planner(plan);
  const auto render = [&](int turns) {
    const relight::Exhibit now = turned(exhibit, turns * kDegree);
    const double time_s = 1e-9 * static_cast<double>(scene.frame.time_ns);
    return renderer.relight(scene.frame, scene.scene, now, planner.decide(scene.scene, now, time_s).plan);
  };
  const relight::RelitPicture first = render(0);  // creates shaders, volumes, shadow maps
  BenchRun run;
  run.warnings = first.warnings;
  run.measures = measure_picture(shrunk(first.srgb, first.srgb.width / scene.camera.width), scene.camera, scene.truth);
  run.still = measure_cost(hardware, 1, [&](int) { return render(0); });
  run.moving = measure_moving(hardware, plan, render);
  return run;
}

}  // namespace lumigraft::server
