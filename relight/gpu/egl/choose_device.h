#pragma once
// Selection among the machine's EGL devices, with the reason for each rejection.
#include "relight/gpu/egl/context.h"

namespace lumigraft::relight::gpu::egl {

/// An EGL device, or Mesa's surfaceless platform.
struct Candidate {
  std::string name;
  EGLDisplay display = EGL_NO_DISPLAY;
  bool software = false;
};

/// By the name of an open context's renderer, as "llvmpipe (LLVM 15.0.6, 256 bits)": Mesa also offers a device for a
/// card without a driver.
bool draws_in_software(const std::string& renderer);

/// Hardware before software. Throws GpuError if there are none.
std::vector<Candidate> find_candidates();

/// Throws GpuError with the reason if it cannot be used.
std::unique_ptr<ContextHandle> open(const Candidate& candidate, bool validation);

/// The first usable candidate; if the environment variable LUMIGRAFT_EGL_DEVICE is set, among those whose renderer's
/// name contains it. Throws GpuError with the reason for each rejection.
std::unique_ptr<ContextHandle> open_best(bool validation);

}  // namespace lumigraft::relight::gpu::egl
