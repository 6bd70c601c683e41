#pragma once
// `lumigraft serve`: the pipeline and the web server, until a signal ends them.
#include <string>

#include "server/pipeline/service_config.h"

namespace lumigraft::server {

/// Returns after SIGINT or SIGTERM. Where a stage is still in a long call when the second of grace is nearly over, ends
/// the process itself, cleanly to the outside: streams are closed, exit code 0.
/// Throws InputError for bad input, std::exception for what fails at start-up.
void run_serve(const ServiceFiles& files, const std::string& listen);

}  // namespace lumigraft::server
