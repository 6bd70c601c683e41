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
};

/// Ordered from the fastest to the most accurate.
std::vector<BenchSetting> bench_settings(const std::string& method);

}  // namespace lumigraft::server
