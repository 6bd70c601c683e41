#include "server/bench/results.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "capture/text_file.h"
#include "server/bench/tables.h"
#include "server/pipeline/json_text.h"

namespace lumigraft::server {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const FieldValue& value) {
  if (const auto* number = std::get_if<Number>(&value)) {
    return std::isfinite(number->value) ? Json(number->value) : Json();
  }
  const auto* text = std::get_if<std::string>(&value);
  return text != nullptr ? Json(*text) : Json(std::get<bool>(value));
}

Json json_of(const Fields& fields) {
  Json json;
  for (const auto& [name, value] : fields) json[name] = json_of(value);
  return json;
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
    json["results"].push_back(json_of(fields_of(row)));
    json["results"].back()["plan"] = plan_json(row.plan);
  }
  for (const auto& [session, stages] : results.stages) {
    for (const auto& [stage, cost] : stages) {
      json["stages"][session][stage] = {{"cpu_ms", cost.cpu_ms}, {"wall_ms", cost.wall_ms}};
    }
  }
  if (!results.work.empty()) {
    Json& work = json["cost_work"] = {
        {"session", results.work_session}, {"setting", results.work_setting}, {"rows", Json::array()}};
    for (const WorkRow& row : results.work) work["rows"].push_back(json_of(fields_of(row)));
  }
  if (!results.budget.empty()) {
    Json& budget = json["error_budget"] = {{"setting", results.budget_setting}, {"rows", Json::array()}};
    for (const BudgetRow& row : results.budget) budget["rows"].push_back(json_of(fields_of(row)));
  }
  capture::write_text(path, json.dump(1) + '\n');
}

}  // namespace lumigraft::server
