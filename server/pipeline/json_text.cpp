#include "server/pipeline/json_text.h"

#include <nlohmann/json.hpp>

namespace lumigraft::server {

nlohmann::ordered_json plan_json(const relight::Plan& plan) {
  return {{"method", plan.method},
          {"look", plan.look},
          {"volume", plan.volume},
          {"trace_scale", plan.trace_scale},
          {"budget_ms", plan.budget_ms},
          {"cells", plan.cells},
          {"rsm", plan.rsm},
          {"max_lights", plan.max_lights},
          {"sh_bands", plan.sh_bands},
          {"bounces", plan.bounces},
          {"lpv_steps", plan.lpv_steps},
          {"rays", plan.rays},
          {"samples", plan.samples},
          {"adaptive", plan.adaptive}};
}

nlohmann::ordered_json transform_json(const Eigen::Isometry3d& transform) {
  auto rows = nlohmann::ordered_json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({transform(r, 0), transform(r, 1), transform(r, 2), transform(r, 3)});
  return rows;
}

std::string json_line(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace lumigraft::server
