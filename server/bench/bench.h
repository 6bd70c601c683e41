#pragma once
// `lumigraft bench`: sessions with truth × methods × settings, how near each picture is and what a frame costs.
//
// OUT gets results.csv, stages.csv, cost_work.csv and error_budget.csv (whole after every row: what fails midway leaves
// what was measured), results.json, and each chart as SVG and PNG.
#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include "relight/gpu/device.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

struct BenchCommand {
  std::vector<std::filesystem::path> sessions;
  std::filesystem::path out;
  OracleParts oracle;                 ///< for the error against time; the error budget has its own
  std::vector<std::string> methods;   ///< empty: all
  std::vector<std::string> settings;  ///< empty: all
  std::vector<std::string> charts;    ///< error-time, cost-work, error-budget; empty: all
  int enlarge = 1;                    ///< pixels along each edge for one of the camera's, for the error against time
  int triangles = 0;                  ///< to which larger objects are simplified for it; 0: none is
  relight::gpu::Backend backend = relight::gpu::Backend::best;
};

/// Throws InputError for bad input, before anything is measured. `interrupted` is looked at between measurements. True
/// when done, false when interrupted.
bool run_bench(const BenchCommand& command, const std::atomic<bool>& interrupted);

}  // namespace lumigraft::server
