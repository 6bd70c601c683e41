#include "server/bench/results_json.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "server/pipeline/plan_json.h"

namespace lumigraft::server {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json number(const std::optional<double>& value) { return value ? number(*value) : Json(nullptr); }

Json json_of(const BenchRow& row) {
  const Measures& m = row.run.measures;
  return {{"session", row.session},
          {"method", row.method},
          {"setting", row.setting},
          {"oracle", row.oracle},
          {"relight_error", number(m.relight_error)},
          {"object_error", number(m.object_error)},
          {"psnr", number(m.psnr_db)},
          {"psnr_affected", number(m.psnr_affected_db)},
          {"psnr_object", number(m.psnr_object_db)},
          {"psnr_relit", number(m.psnr_relit_db)},
          {"flip", number(m.flip)},
          {"cpu_ms", number(row.run.moving.host.cpu_ms)},
          {"wall_ms", number(row.run.moving.host.wall_ms)},
          {"gpu_ms", number(row.run.moving.gpu_ms)},
          {"still_cpu_ms", number(row.run.still.host.cpu_ms)},
          {"still_wall_ms", number(row.run.still.host.wall_ms)},
          {"still_gpu_ms", number(row.run.still.gpu_ms)},
          {"plan", plan_json(row.plan)}};
}

}  // namespace

void write_results_json(const std::filesystem::path& path, const BenchResults& results) {
  Json json{{"machine",
             {{"cpu", results.machine.cpu},
              {"cores", results.machine.cores},
              {"device", results.machine.device},
              {"hardware", results.machine.hardware},
              {"program", results.machine.program}}},
            {"oracle", results.oracle},
            {"enlarged", results.enlarged},
            {"most_triangles", results.max_triangles},
            {"results", Json::array()},
            {"stages", Json::object()}};
  for (const BenchRow& row : results.rows) {
    json["results"].push_back(json_of(row));
  }
  for (const auto& [session, stages] : results.stages) {
    for (const auto& [stage, cost] : stages) {
      json["stages"][session][stage] = {{"cpu_ms", cost.cpu_ms}, {"wall_ms", cost.wall_ms}};
    }
  }
  if (!results.work.empty()) {
    Json& work = json["cost_work"] = {
        {"session", results.work_session}, {"setting", results.work_setting}, {"rows", Json::array()}};
    for (const WorkRow& row : results.work) {
      work["rows"].push_back({{"work", row.work},
                              {"amount", row.amount},
                              {"base", row.base},
                              {"cpu_ms", number(row.cost.host.cpu_ms)},
                              {"wall_ms", number(row.cost.host.wall_ms)},
                              {"gpu_ms", number(row.cost.gpu_ms)}});
    }
  }
  if (!results.budget.empty()) {
    Json& budget = json["error_budget"] = {{"setting", results.budget_setting}, {"rows", Json::array()}};
    for (const BudgetRow& row : results.budget) {
      budget["rows"].push_back({{"session", row.session},
                                {"estimated", row.estimated},
                                {"relight_error", number(row.relight_error)},
                                {"object_error", number(row.object_error)}});
    }
  }
  const std::filesystem::path partial = path.string() + ".partial";
  {
    std::ofstream out(partial);
    out << json.dump(1) << '\n';
    out.close();
    if (!out) {
      throw std::runtime_error(partial.string() + ": cannot be written");
    }
  }
  std::filesystem::rename(partial, path);
}

}  // namespace lumigraft::server
