#pragma once
// `lumigraft serve`: runs the pipeline and the web server until a signal ends them.
#include <string>

#include "server/pipeline/service_config.h"

namespace lumigraft::server {

/// Returns after SIGINT or SIGTERM. Where a stage is still in a long call when the grace period ends, ends the process
/// itself: streams are closed, exit code 0. Throws InputError for bad input, std::exception for failures at start-up.
void run_serve(const ServiceFiles& files, const std::string& listen);

}  // namespace lumigraft::server
