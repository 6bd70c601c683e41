#include "server/commands/doctor/doctor.h"

#include <Eigen/Core>
#include <thread>

#include "server/commands/doctor/camera_checks.h"
#include "server/commands/doctor/gpu_checks.h"
#include "server/commands/doctor/machine_checks.h"
#include "server/commands/doctor/service_checks.h"
#include "server/metrics/version.h"

namespace lumigraft::server {

bool write_doctor_report(const DoctorCommand& command, std::ostream& out) {
  out << version_line() << ", " << std::thread::hardware_concurrency() << " cores, "
      << Eigen::SimdInstructionSetsInUse() << '\n';
  DoctorReport report(out);
  std::optional<ServiceInput> input;
  if (!command.config.empty())
    input = check_configuration(
        report, {.config = command.config, .session = {}, .exhibit = {}, .overrides = {}, .with_saved = true});
  const ServerSettings server = input ? input->server : ServerSettings{};

  check_gpu(report, server.backend);
  check_encoders(report);
  check_user(report);
  check_cameras(report, capture::list_cameras(), input ? &input->session : nullptr);
  check_realtime(report);
  check_network_buffer(report);
  check_memory(report, server.fusion.max_memory_mb, usable_memory_bytes());
  check_clock(report, std::chrono::system_clock::now());
  if (input) {
    check_listeners(report, server.listeners);
    check_folders(report, *input);
  }
  report.line(report.good() ? "everything that serve and replay need is here"
                            : "something that serve and replay need is missing");
  return report.good();
}

}  // namespace lumigraft::server
