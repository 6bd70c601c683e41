#pragma once
// The bench's results as named values, for its CSV tables and for results.json.
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/bench/results.h"

namespace lumigraft::server {

struct Number {
  double value = 0;  ///< not finite where it is missing: no such pixels, no GPU
  int decimals = 0;  ///< in a table
};
using FieldValue = std::variant<std::string, bool, Number>;
using Fields = std::vector<std::pair<std::string, FieldValue>>;

Fields fields_of(const BenchRow& row);
/// Of one pass while objects turn.
Fields fields_of(const BenchRow& row, const relight::gpu::PassTime& pass);
Fields fields_of(const WorkRow& row);
Fields fields_of(const BudgetRow& row);
Fields fields_of(const std::string& session, const std::string& stage, const reconstruct::StageCost& cost);

/// A CSV table, flushed after every row. Missing numbers are empty cells.
class CsvFile {
 public:
  /// Names the columns as the fields of a row. Throws InputError where the file cannot be written.
  CsvFile(const std::filesystem::path& path, const Fields& columns);
  void add(const Fields& row);

 private:
  void write(const std::vector<std::string>& cells);

  std::filesystem::path path_;
  std::ofstream out_;
};

}  // namespace lumigraft::server
