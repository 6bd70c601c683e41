#pragma once
// JSON of the texts that the service and replay write.
#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "relight/plan.h"

namespace lumigraft::server {

/// The same keys as plan.KEY.
nlohmann::ordered_json plan_json(const relight::Plan& plan);

/// Rows of the 4x4 matrix.
nlohmann::ordered_json transform_json(const Eigen::Isometry3d& transform);

/// One line of valid UTF-8: invalid bytes, such as those of file names in warnings, are replaced.
std::string json_line(const nlohmann::ordered_json& json);

}  // namespace lumigraft::server
