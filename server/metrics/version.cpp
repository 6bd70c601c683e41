#include "server/metrics/version.h"

namespace lumigraft::server {

std::string version_line() { return "lumigraft " LUMIGRAFT_VERSION; }

}  // namespace lumigraft::server
