#pragma once
// The main chart: error against frame time, a point per setting, with the Pareto front.
#include <filesystem>

#include "server/bench/results.h"

namespace lumigraft::server {

enum class CostKind { cpu, gpu };

/// Means of one setting of one method over all sessions.
struct SettingMean {
  std::string method, setting;
  double relight_error = 0;
  double cost_ms = 0;        ///< while the object turns
  double still_cost_ms = 0;  ///< static scene
};

/// Arithmetic means over the sessions, in the order of the rows. Leaves out settings that lack a finite error or a cost
/// of this kind in some session.
std::vector<SettingMean> mean_over_sessions(const std::vector<BenchRow>& rows, CostKind kind);

/// Indices of the Pareto-optimal settings in error and cost, fastest first.
std::vector<std::size_t> pareto_front(const std::vector<SettingMean>& means);

/// Writes STEM.svg and STEM.png. Writes nothing where no setting has a cost of this kind.
void draw_error_time(const BenchResults& results, CostKind kind, const std::filesystem::path& stem);

}  // namespace lumigraft::server
