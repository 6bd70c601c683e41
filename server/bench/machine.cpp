#include "server/bench/machine.h"

#include <fstream>
#include <thread>

#include "server/metrics/version.h"

namespace lumigraft::server {
namespace {

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (const std::size_t colon = line.find(": "); line.starts_with("model name") && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  return "unknown processor";
}

}  // namespace

BenchMachine describe_machine(const relight::gpu::Device& device) {
  return {processor_name(), std::thread::hardware_concurrency(), device.name(), !device.is_software(), version_line()};
}

std::string line_of(const BenchMachine& machine) {
  return machine.cpu + ", " + std::to_string(machine.cores) + " cores; " + machine.device + "; " + machine.program;
}

}  // namespace lumigraft::server
