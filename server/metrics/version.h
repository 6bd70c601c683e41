#pragma once
#include <string>

namespace lumigraft::server {

std::string version_line();  ///< "lumigraft 0.1.0"

}  // namespace lumigraft::server
