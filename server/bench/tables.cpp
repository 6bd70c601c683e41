#include "server/bench/tables.h"

#include <cmath>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include "capture/error.h"

namespace lumigraft::server {
namespace {

/// Empty where the number is missing.
std::string cell(double value, int decimals) {
  if (!std::isfinite(value)) {
    return "";
  }
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::string cell(const std::optional<double>& value, int decimals) { return value ? cell(*value, decimals) : ""; }

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) {
    return text;
  }
  std::string result = "\"";
  for (const char c : text) {
    result += c == '"' ? "\"\"" : std::string(1, c);
  }
  return result + '"';
}

}  // namespace

CsvFile::CsvFile(const std::filesystem::path& path, const std::vector<std::string>& columns) : path_(path), out_(path) {
  if (!out_) {
    throw capture::InputError(path.string() + ": cannot be written");
  }
  add(columns);
}

void CsvFile::add(const std::vector<std::string>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    out_ << (i == 0 ? "" : ",") << quoted(cells[i]);
  }
  out_ << '\n' << std::flush;
  if (!out_) {
    throw std::runtime_error(path_.string() + ": cannot be written");
  }
}

std::vector<std::string> result_columns() {
  return {"session", "method",        "setting",      "oracle",        "relight_error", "object_error",
          "psnr",    "psnr_affected", "psnr_object",  "psnr_relit",    "flip",          "cpu_ms",
          "wall_ms", "gpu_ms",        "still_cpu_ms", "still_wall_ms", "still_gpu_ms"};
}

std::vector<std::string> result_cells(const BenchRow& row) {
  const Measures& m = row.run.measures;
  const FrameCost &moving = row.run.moving, &still = row.run.still;
  return {row.session,
          row.method,
          row.setting,
          row.oracle,
          cell(m.relight_error, 4),
          cell(m.object_error, 4),
          cell(m.psnr_db, 2),
          cell(m.psnr_affected_db, 2),
          cell(m.psnr_object_db, 2),
          cell(m.psnr_relit_db, 2),
          cell(m.flip, 4),
          cell(moving.host.cpu_ms, 1),
          cell(moving.host.wall_ms, 1),
          cell(moving.gpu_ms, 3),
          cell(still.host.cpu_ms, 1),
          cell(still.host.wall_ms, 1),
          cell(still.gpu_ms, 3)};
}

std::vector<std::string> work_columns() { return {"work", "amount", "base", "cpu_ms", "wall_ms", "gpu_ms"}; }

std::vector<std::string> work_cells(const WorkRow& row) {
  return {row.work,
          cell(row.amount, 0),
          row.base ? "1" : "0",
          cell(row.cost.host.cpu_ms, 1),
          cell(row.cost.host.wall_ms, 1),
          cell(row.cost.gpu_ms, 3)};
}

std::vector<std::string> budget_columns() { return {"session", "estimated", "relight_error", "object_error"}; }

std::vector<std::string> budget_cells(const BudgetRow& row) {
  return {row.session, row.estimated, cell(row.relight_error, 4), cell(row.object_error, 4)};
}

std::vector<std::string> stage_columns() { return {"session", "stage", "cpu_ms", "wall_ms"}; }

std::vector<std::string> stage_cells(const std::string& session, const std::string& stage,
                                     const reconstruct::StageCost& cost) {
  return {session, stage, cell(cost.cpu_ms, 1), cell(cost.wall_ms, 1)};
}

}  // namespace lumigraft::server
