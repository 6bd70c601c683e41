#pragma once
// `lumigraft bench`: sessions with truth × methods × settings; measures the error of each picture and the cost of a
// frame.
//
// Writes results.csv, stages.csv, passes.csv, cost_work.csv and error_budget.csv into OUT, complete after every row so
// that a failure keeps earlier measurements, then results.json, and each chart as SVG and PNG.
#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "relight/gpu/device.h"
#include "server/bench/shard.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

struct BenchCommand {
  std::vector<std::filesystem::path> sessions;
  std::filesystem::path out;
  OracleParts oracle;                 ///< for error-time; the error budget uses its own
  std::vector<std::string> methods;   ///< empty: all
  std::vector<std::string> settings;  ///< empty: all
  std::vector<std::string> charts;    ///< error-time, cost-work, error-budget; empty: all
  std::optional<Shard> shard;         ///< only this part of the rows, for error-time; no other chart
  int enlarge = 1;                    ///< upscaling factor of the camera picture along each edge, for error-time
  int triangles = 0;  ///< limit to which larger objects are simplified, for error-time; 0: not simplified
  relight::gpu::Backend backend = relight::gpu::Backend::best;
};

/// Throws InputError for bad input, before anything is measured. `interrupted` is checked between measurements. True
/// when done, false when interrupted.
bool run_bench(const BenchCommand& command, const std::atomic<bool>& interrupted);

}  // namespace lumigraft::server
