#pragma once
// The plan as JSON, the same keys as plan.KEY.
#include <nlohmann/json_fwd.hpp>

#include "relight/plan.h"

namespace lumigraft::server {

nlohmann::ordered_json plan_json(const relight::Plan& plan);

}  // namespace lumigraft::server
