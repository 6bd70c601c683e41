#pragma once
// The plan as JSON, the same keys as plan.KEY.
#include <nlohmann/json_fwd.hpp>

#include "relight/plan.h"

namespace lumigraft {

nlohmann::ordered_json plan_json(const Plan& plan);

}  // namespace lumigraft
