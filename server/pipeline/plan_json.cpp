#include "server/pipeline/plan_json.h"

#include <nlohmann/json.hpp>

namespace lumigraft::server {

nlohmann::ordered_json plan_json(const relight::Plan& plan) {
  return {{"method", plan.method},     {"volume", plan.volume},   {"trace_scale", plan.trace_scale},
          {"cells", plan.cells},       {"rsm", plan.rsm},         {"max_lights", plan.max_lights},
          {"sh_bands", plan.sh_bands}, {"bounces", plan.bounces}, {"lpv_steps", plan.lpv_steps},
          {"rays", plan.rays},         {"samples", plan.samples}, {"adaptive", plan.adaptive}};
}

}  // namespace lumigraft::server
