#pragma once
// User, scheduling, network buffers, memory and clock of this machine.
#include <chrono>
#include <cstdint>
#include <optional>

#include "server/commands/doctor/report.h"

namespace lumigraft::server {

void check_user(DoctorReport& report);
void check_realtime(DoctorReport& report);
void check_network_buffer(DoctorReport& report);
void check_clock(DoctorReport& report, std::chrono::system_clock::time_point now);
/// Of the reconstructed room, as `server.max_field_memory_mb` allows it, in what this process may use.
void check_memory(DoctorReport& report, double field_mb, std::optional<std::uintmax_t> usable_bytes);

/// The least of the machine's memory and the limits of the control groups that contain this process.
std::optional<std::uintmax_t> usable_memory_bytes();

}  // namespace lumigraft::server
