#pragma once
// Which settings the bench tries of each method.
#include <string>
#include <vector>

#include "relight/plan.h"

namespace lumigraft::server {

struct BenchSetting {
  /// As "half-64": what trace_scale is called, the volume's edge, then what else is unusual; "as-needed" where the plan
  /// follows the scene; or "16-paths" a pixel.
  std::string name;
  relight::Plan plan;
};

/// From the quickest to the most careful.
std::vector<BenchSetting> bench_settings(const std::string& method);

}  // namespace lumigraft::server
