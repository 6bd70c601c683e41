#pragma once
// What a configuration asks for, as serve would find it.
#include "server/commands/doctor/report.h"
#include "server/pipeline/service_config.h"

namespace lumigraft::server {

/// Reads it with all models of its exhibit. Empty if it cannot be used, which is reported.
std::optional<ServiceInput> check_configuration(DoctorReport& report, const ServiceFiles& files);
/// Whether its addresses are free and its certificates usable. Binds them for a moment.
void check_listeners(DoctorReport& report, const std::vector<ListenerSettings>& listeners);
/// Whether what serve writes can be written, and the disk has room.
void check_folders(DoctorReport& report, const ServiceInput& input);

}  // namespace lumigraft::server
