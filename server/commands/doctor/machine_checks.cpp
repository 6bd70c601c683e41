#include "server/commands/doctor/machine_checks.h"

#include <sched.h>
#include <sys/resource.h>
#include <sys/sysinfo.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "capture/message_text.h"
#include "server/commands/doctor/permissions.h"

namespace lumigraft::server {
namespace {

constexpr std::uintmax_t kGige_buffer_bytes = 8388608;  // two frames of a fast camera
constexpr std::chrono::sys_days kNever_before{std::chrono::year{2020} / 1 / 1};
constexpr double kMax_share = 0.5;  // of memory; the other half is for cameras, models and pictures
constexpr double kMin_field_mb = 64;

std::optional<std::uintmax_t> number_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::uintmax_t value = 0;
  return in >> value ? std::optional(value) : std::nullopt;
}

/// The folder of this process in the hierarchy of control groups, version 2.
std::filesystem::path control_group() {
  std::ifstream in("/proc/self/cgroup");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("0::/")) return line.substr(4);
  return {};
}

}  // namespace

void check_user(DoctorReport& report) { report.line("user: " + user_text()); }

void check_realtime(DoctorReport& report) {
  sched_param before{};
  sched_getparam(0, &before);
  const int policy = sched_getscheduler(0);
  const sched_param lowest{.sched_priority = sched_get_priority_min(SCHED_RR)};
  if (sched_setscheduler(0, SCHED_RR, &lowest) == 0) {
    sched_setscheduler(0, policy, &before);
    report.ok("real-time priority", "camera threads have it");
    return;
  }
  report.note("real-time priority", "not allowed: a busy machine may lose frames of cameras",
              "LimitRTPRIO=1 in the unit of the service, or \"* - rtprio 1\" in "
              "/etc/security/limits.d/lumigraft.conf and a new login");
}

void check_network_buffer(DoctorReport& report) {
  const std::optional<std::uintmax_t> bytes = number_in("/proc/sys/net/core/rmem_max");
  if (!bytes) return;
  const std::string text = std::to_string(*bytes) + " bytes at most (net.core.rmem_max)";
  if (*bytes >= kGige_buffer_bytes) return report.ok("network buffer", text);
  report.note("network buffer", text + ": fast GigE Vision cameras may lose frames",
              "echo net.core.rmem_max=" + std::to_string(kGige_buffer_bytes) +
                  " | sudo tee /etc/sysctl.d/60-lumigraft.conf && sudo sysctl --system");
}

void check_clock(DoctorReport& report, std::chrono::system_clock::time_point now) {
  const std::chrono::year_month_day today{std::chrono::floor<std::chrono::days>(now)};
  const std::string date = capture::formatted("%d-%02u-%02u", static_cast<int>(today.year()),
                                              static_cast<unsigned>(today.month()), static_cast<unsigned>(today.day()));
  if (now >= kNever_before) return report.ok("clock", date);
  report.note("clock", "it is not set, " + date + ": recordings have wrong names, certificates seem to begin later",
              "sudo apt install systemd-timesyncd && sudo timedatectl set-ntp true");
}

std::optional<std::uintmax_t> usable_memory_bytes() {
  struct sysinfo machine {};
  if (sysinfo(&machine) != 0) return std::nullopt;
  std::uintmax_t bytes = std::uintmax_t{machine.totalram} * machine.mem_unit;
  for (std::filesystem::path group = control_group();; group = group.parent_path()) {
    if (const auto limit = number_in("/sys/fs/cgroup" / group / "memory.max")) bytes = std::min(bytes, *limit);
    if (group.empty()) return bytes;
  }
}

void check_memory(DoctorReport& report, double field_mb, std::optional<std::uintmax_t> usable_bytes) {
  if (!usable_bytes) return;
  const double usable_mb = static_cast<double>(*usable_bytes) / 1e6;
  const std::string text = capture::formatted("%.0f MB of %.0f MB for the reconstructed room", field_mb, usable_mb);
  if (field_mb <= kMax_share * usable_mb) return report.ok("memory", text);
  const double fits_mb = std::max(kMin_field_mb, kMax_share * usable_mb);
  report.note("memory", text + " (server.max_field_memory_mb): a large room leaves too little for the rest",
              capture::formatted("server.max_field_memory_mb = %.0f", fits_mb));
}

}  // namespace lumigraft::server
