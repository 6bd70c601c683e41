#pragma once
// The error budget: the error caused by each estimated part of the scene, and by rendering itself.
#include <string>
#include <vector>

#include "server/bench/results.h"

namespace lumigraft::server {

/// Which part of the scene is estimated; the other parts are true.
struct BudgetCase {
  std::string estimated;  ///< "nothing", "pose" ... "everything"
  OracleParts oracle;
};

/// In order: nothing, each part alone, everything.
std::vector<BudgetCase> budget_cases();

/// Renders and scores one picture with the parts of `budget` estimated; every case uses the same frame.
BudgetRow measure_budget(const std::shared_ptr<relight::gpu::Device>& device, const std::string& name,
                         const capture::Session& session, const relight::Exhibit& exhibit, const relight::Plan& plan,
                         const BudgetCase& budget);

/// Writes STEM.svg and STEM.png.
void draw_error_budget(const BenchResults& results, const std::filesystem::path& stem);

}  // namespace lumigraft::server
