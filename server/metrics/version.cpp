#include "server/metrics/version.h"

namespace lumigraft {

std::string version_line() { return "lumigraft " LUMIGRAFT_VERSION; }

}  // namespace lumigraft
