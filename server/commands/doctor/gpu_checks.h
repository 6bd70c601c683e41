#pragma once
// GPU devices and encoders.
#include "relight/gpu/device.h"
#include "server/commands/doctor/report.h"

namespace lumigraft::server {

void check_gpu(DoctorReport& report, relight::gpu::Backend backend);
void check_encoders(DoctorReport& report);

}  // namespace lumigraft::server
