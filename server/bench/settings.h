#pragma once
// The settings that the bench runs for each method.
#include <string>
#include <vector>

#include "relight/plan.h"

namespace lumigraft::server {

struct BenchSetting {
  /// Such as "half-64": trace_scale, the volume's edge length in cells, then non-default values; "as-needed" where the
  /// plan is adaptive; or "16-paths" per pixel.
  std::string name;
  relight::Plan plan;
  /// How long its row takes to measure, roughly: on the first 320×240 session of the results, with two cores. To divide
  /// work evenly.
  double run_s = 0;
};

/// Ordered from the fastest to the most accurate.
std::vector<BenchSetting> bench_settings(const std::string& method);

}  // namespace lumigraft::server
