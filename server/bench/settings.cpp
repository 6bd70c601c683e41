#include "server/bench/settings.h"

namespace lumigraft::server {
namespace {

struct Traced {
  const char* name;
  int trace_scale, cells, rsm;
};
constexpr Traced kLive{"live", 4, 0, 128}, kCells{"cells", 2, 1, 256}, kHalf{"half", 2, 0, 256},
    kCareful{"careful", 1, 0, 256};

BenchSetting setting(const std::string& method, const Traced& traced, int volume, double run_s) {
  relight::Plan plan;
  plan.method = method;
  plan.trace_scale = traced.trace_scale;
  plan.cells = traced.cells;
  plan.rsm = traced.rsm;
  plan.volume = volume;
  plan.adaptive = 0;
  return {std::string(traced.name) + "-" + std::to_string(volume), plan, run_s};
}

BenchSetting with_bounces(BenchSetting setting, int bounces) {
  setting.name += "-" + std::to_string(bounces) + (bounces == 1 ? "-bounce" : "-bounces");
  setting.plan.bounces = bounces;
  return setting;
}

BenchSetting as_needed(BenchSetting setting) {
  setting.name += "-as-needed";
  setting.plan.adaptive = 1;
  return setting;
}

BenchSetting paths(const std::string& method, int samples, double run_s) {
  relight::Plan plan;
  plan.method = method;
  plan.samples = samples;
  return {std::to_string(samples) + "-paths", plan, run_s};
}

BenchSetting gathered(int trace_scale, int rays, double run_s) {
  relight::Plan plan;
  plan.method = "rays";
  plan.trace_scale = trace_scale;
  plan.rays = rays;
  const char* name = trace_scale == 1   ? "careful-"
                     : trace_scale == 2 ? "half-"
                     : trace_scale == 4 ? "quarter-"
                     : trace_scale == 8 ? "live-"
                                        : "coarse-";
  return {name + std::to_string(rays) + "-rays", plan, run_s};
}

}  // namespace

std::vector<BenchSetting> bench_settings(const std::string& method) {
  if (method == "reference") return {paths(method, 16, 50), paths(method, 64, 200)};
  if (method == "rays") {
    return {gathered(16, 8, 4), gathered(8, 8, 4),  gathered(4, 8, 4),  gathered(4, 20, 5),
            gathered(2, 20, 6), gathered(2, 64, 7), gathered(1, 64, 17)};
  }
  const auto of = [&](const Traced& traced, int volume, double run_s) {
    return setting(method, traced, volume, run_s);
  };
  std::vector<BenchSetting> settings{
      of(kLive, 32, 12), of(kLive, 64, 15), of(kCells, 64, 45), of(kCells, 128, 60), with_bounces(of(kHalf, 64, 8), 1),
      of(kHalf, 64, 7)};
  if (method == "dvct") {
    settings.push_back(as_needed(of(kLive, 64, 13)));
    settings.push_back(as_needed(of(kHalf, 64, 7)));
    settings.push_back(of(kHalf, 128, 15));
    settings.push_back(of(kCareful, 64, 12));
  }
  return settings;
}

}  // namespace lumigraft::server
