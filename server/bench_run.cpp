#include "server/bench_run.h"

#include <algorithm>
#include <functional>
#include <numbers>
#include <vector>

namespace lumigraft {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kMostFrames = 5;
constexpr double kEnough_ms = 1000;  ///< of measuring one cost

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double gpu_ms_of(const RelitPicture& picture) {
  double sum_ms = 0;
  for (const gpu::PassTime& pass : picture.passes) {
    sum_ms += pass.gpu_ms;
  }
  return sum_ms;
}

/// `frame` renders the i-th picture.
FrameCost measure_cost(bool hardware, const std::function<RelitPicture(int)>& frame) {
  std::vector<double> wall_ms, cpu_ms, gpu_ms;
  double spent_ms = 0;
  for (int i = 0; i < kMostFrames && spent_ms < kEnough_ms; ++i) {
    const CostClock clock;
    const RelitPicture picture = frame(i);
    const StageCost cost = clock.elapsed();
    wall_ms.push_back(cost.wall_ms);
    cpu_ms.push_back(cost.cpu_ms);
    gpu_ms.push_back(gpu_ms_of(picture));
    spent_ms += cost.wall_ms;
  }
  FrameCost result{{median(wall_ms), median(cpu_ms)}, std::nullopt};
  if (hardware) {
    result.gpu_ms = median(gpu_ms);
  }
  return result;
}

}  // namespace

Exhibit turned(const Exhibit& exhibit, double angle_rad) {
  Exhibit result = exhibit;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()));
  for (VirtualObject& object : result.objects) {
    object.rotation = turn * object.rotation;
    for (KeyFrame& key : object.motion) {
      key.rotation = turn * key.rotation;
    }
  }
  return result;
}

FrameCost cost_of_turning(Renderer& renderer, const FrameSet& frame, const Scene& scene, const Exhibit& exhibit,
                          const Plan& plan, bool hardware) {
  const auto render = [&](int i) { return renderer.relight(frame, scene, turned(exhibit, i * kDegree), plan); };
  render(0);
  return measure_cost(hardware, [&](int i) { return render(i + 1); });
}

BenchRun run_setting(Renderer& renderer, const BenchScene& scene, const Exhibit& exhibit, const Plan& plan,
                     bool hardware) {
  const auto render = [&](int turns) {
    const Exhibit now = turned(exhibit, turns * kDegree);
    return renderer.relight(scene.frame, scene.scene, now, plan);
  };
  const RelitPicture first = render(0);  // makes what it needs: shaders, volumes, shadow maps
  BenchRun run;
  run.warnings = first.warnings;
  run.measures = measure_picture(first.srgb, scene.camera, scene.truth);
  run.still = measure_cost(hardware, [&](int) { return render(0); });
  run.moving = measure_cost(hardware, [&](int i) { return render(i + 1); });
  return run;
}

}  // namespace lumigraft
