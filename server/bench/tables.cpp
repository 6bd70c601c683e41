#include "server/bench/tables.h"

#include <cmath>
#include <stdexcept>

#include "capture/error.h"
#include "capture/message_text.h"

namespace lumigraft::server {
namespace {

Number device_ms(const FrameCost& cost) { return {cost.gpu_ms.value_or(std::nan("")), 3}; }

std::string cell(const FieldValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "1" : "0";
  const Number& number = std::get<Number>(value);
  return std::isfinite(number.value) ? capture::formatted("%.*f", number.decimals, number.value) : "";
}

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? "\"\"" : std::string(1, c);
  return result + '"';
}

}  // namespace

CsvFile::CsvFile(const std::filesystem::path& path, const Fields& columns) : path_(path), out_(path) {
  capture::refuse_if(!out_, path.string() + ": cannot be written");
  std::vector<std::string> names;
  for (const auto& [name, value] : columns) names.push_back(name);
  write(names);
}

void CsvFile::add(const Fields& row) {
  std::vector<std::string> cells;
  for (const auto& [name, value] : row) cells.push_back(cell(value));
  write(cells);
}

void CsvFile::write(const std::vector<std::string>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) out_ << (i == 0 ? "" : ",") << quoted(cells[i]);
  out_ << '\n' << std::flush;
  if (!out_) throw std::runtime_error(path_.string() + ": cannot be written");
}

Fields fields_of(const BenchRow& row) {
  const Measures& m = row.run.measures;
  const FrameCost &moving = row.run.moving, &still = row.run.still;
  return {{"session", row.session},
          {"method", row.method},
          {"setting", row.setting},
          {"oracle", row.oracle},
          {"relight_error", Number{m.relight_error, 4}},
          {"object_error", Number{m.object_error, 4}},
          {"psnr", Number{m.psnr_db, 2}},
          {"psnr_affected", Number{m.psnr_affected_db, 2}},
          {"psnr_object", Number{m.psnr_object_db, 2}},
          {"psnr_relit", Number{m.psnr_relit_db, 2}},
          {"flip", Number{m.flip, 4}},
          {"cpu_ms", Number{moving.host.cpu_ms, 1}},
          {"wall_ms", Number{moving.host.wall_ms, 1}},
          {"gpu_ms", device_ms(moving)},
          {"still_cpu_ms", Number{still.host.cpu_ms, 1}},
          {"still_wall_ms", Number{still.host.wall_ms, 1}},
          {"still_gpu_ms", device_ms(still)}};
}

Fields fields_of(const BenchRow& row, const relight::gpu::PassTime& pass) {
  return {{"session", row.session},
          {"method", row.method},
          {"setting", row.setting},
          {"pass", pass.name},
          {"ms", Number{pass.gpu_ms, 3}}};
}

Fields fields_of(const WorkRow& row) {
  return {{"work", row.work},
          {"amount", Number{row.amount, 0}},
          {"base", row.base},
          {"cpu_ms", Number{row.cost.host.cpu_ms, 1}},
          {"wall_ms", Number{row.cost.host.wall_ms, 1}},
          {"gpu_ms", device_ms(row.cost)}};
}

Fields fields_of(const BudgetRow& row) {
  return {{"session", row.session},
          {"estimated", row.estimated},
          {"relight_error", Number{row.relight_error, 4}},
          {"object_error", Number{row.object_error, 4}}};
}

Fields fields_of(const std::string& session, const std::string& stage, const reconstruct::StageCost& cost) {
  return {
      {"session", session}, {"stage", stage}, {"cpu_ms", Number{cost.cpu_ms, 1}}, {"wall_ms", Number{cost.wall_ms, 1}}};
}

}  // namespace lumigraft::server
