#pragma once
// The main chart: error against time, a point for every setting, with the Pareto front.
#include <filesystem>

#include "server/bench/results.h"

namespace lumigraft::server {

enum class CostKind { cpu, gpu };

/// One setting of one method over all sessions.
struct SettingMean {
  std::string method, setting;
  double relight_error = 0;
  double cost_ms = 0;        ///< the object turning
  double still_cost_ms = 0;  ///< nothing moving
};

/// Arithmetic means over the sessions, of settings that every session has with a finite error and a cost of the kind;
/// in the order of the rows.
std::vector<SettingMean> mean_over_sessions(const std::vector<BenchRow>& rows, CostKind kind);

/// Indices of those that no other beats in both error and cost, from the quickest on.
std::vector<std::size_t> pareto_front(const std::vector<SettingMean>& means);

/// Writes STEM.svg and STEM.png. Nothing where no setting has a cost of the kind.
void draw_error_time(const BenchResults& results, CostKind kind, const std::filesystem::path& stem);

}  // namespace lumigraft::server
