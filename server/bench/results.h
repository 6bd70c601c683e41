#pragma once
// Results of the bench, and the machine that they were measured on.
#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "server/bench/machine.h"
#include "server/bench/setting_run.h"

namespace lumigraft::server {

struct BenchRow {
  std::string session, method, setting, oracle;
  relight::Plan plan;
  BenchRun run;
};

/// Cost of a frame for one amount of one kind of work.
struct WorkRow {
  std::string work;  ///< pixels, triangles, voxels, lights, objects, bounces
  double amount = 0;
  bool base = false;  ///< the session's own amount
  FrameCost cost;
};

/// The error with some parts of the scene estimated and the others true.
struct BudgetRow {
  std::string session, estimated;  ///< "nothing", "pose" ... "everything"
  double relight_error = 0, object_error = 0;
};

struct BenchResults {
  BenchMachine machine;
  std::string oracle;
  int enlarged = 1, max_triangles = 0;  ///< as BenchCommand
  std::vector<BenchRow> rows;
  std::string work_session, work_setting;  ///< session and setting of the work rows
  std::vector<WorkRow> work;
  std::string budget_setting;
  std::vector<BudgetRow> budget;
  std::map<std::string, std::map<std::string, reconstruct::StageCost>> stages;  ///< by session and stage
};

/// Writes all results as results.json: the whole file or none. Missing numbers are null.
void write_results_json(const std::filesystem::path& path, const BenchResults& results);

/// The different values of one member, in the order of their first rows.
template <typename Row>
std::vector<std::string> distinct(const std::vector<Row>& rows, std::string Row::*member) {
  std::vector<std::string> values;
  for (const Row& row : rows) {
    if (std::find(values.begin(), values.end(), row.*member) == values.end()) values.push_back(row.*member);
  }
  return values;
}

}  // namespace lumigraft::server
