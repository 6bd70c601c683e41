#pragma once
// Whether this machine draws with the processor only, asked in a process of its own: drivers of software devices bring
// a compiler (LLVM) that takes 80 MB and is never unloaded, and a service whose pictures rays draw needs none of it.
#include "relight/gpu/device.h"

namespace lumigraft::server {

/// True if the device that create_device would return is a software one. False also if that could not be found out, so
/// that whoever then calls create_device learns what is wrong. To be called before there are threads that matter: the
/// new process is a copy of this one.
bool only_software_device(relight::gpu::Backend backend);

}  // namespace lumigraft::server
