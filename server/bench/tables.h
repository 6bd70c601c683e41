#pragma once
// The bench's CSV tables, flushed after every row.
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "server/bench/results.h"

namespace lumigraft::server {

class CsvFile {
 public:
  /// Throws InputError where the file cannot be written.
  CsvFile(const std::filesystem::path& path, const std::vector<std::string>& columns);
  void add(const std::vector<std::string>& cells);

 private:
  std::filesystem::path path_;
  std::ofstream out_;
};

// Missing numbers (no such pixels, no GPU) are empty cells.
std::vector<std::string> result_columns();
std::vector<std::string> result_cells(const BenchRow& row);
std::vector<std::string> work_columns();
std::vector<std::string> work_cells(const WorkRow& row);
std::vector<std::string> budget_columns();
std::vector<std::string> budget_cells(const BudgetRow& row);
std::vector<std::string> stage_columns();
std::vector<std::string> stage_cells(const std::string& session, const std::string& stage,
                                     const reconstruct::StageCost& cost);

}  // namespace lumigraft::server
