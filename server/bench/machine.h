#pragma once
// The machine on which the bench ran.
#include <string>

#include "relight/gpu/device.h"

namespace lumigraft::server {

struct BenchMachine {
  std::string cpu;
  unsigned cores = 0;
  std::string device;
  bool hardware = false;  ///< the device is a GPU
  std::string program;    ///< "lumigraft 0.1.0"
};

/// This machine and the rendering device.
BenchMachine describe_machine(const relight::gpu::Device& device);
std::string line_of(const BenchMachine& machine);  ///< for the footer of charts

}  // namespace lumigraft::server
