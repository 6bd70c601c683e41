#pragma once
// The error budget: how much of the error each estimated part of the room causes, and how much rendering itself.
#include <string>
#include <vector>

#include "server/bench/results.h"

namespace lumigraft::server {

/// What of the room is estimated while the rest is true.
struct BudgetCase {
  std::string estimated;  ///< "nothing", "pose" ... "everything"
  OracleParts oracle;
};

/// Nothing first, then one part at a time, then everything.
std::vector<BudgetCase> budget_cases();

/// One picture with the room as `budget` says, on the same frame of the session for every case.
BudgetRow measure_budget(const std::shared_ptr<relight::gpu::Device>& device, const std::string& name,
                         const capture::Session& session, const relight::Exhibit& exhibit, const relight::Plan& plan,
                         const BudgetCase& budget);

/// Writes STEM.svg and STEM.png.
void draw_error_budget(const BenchResults& results, const std::filesystem::path& stem);

}  // namespace lumigraft::server
