#pragma once
// Which of the machine's EGL devices to use, and why not the others.
#include "relight/gpu/egl/context.h"

namespace lumigraft::relight::gpu::egl {

/// One way to a driver: an EGL device, or Mesa without a surface.
struct Candidate {
  std::string name;
  EGLDisplay display = EGL_NO_DISPLAY;
  bool software = false;
};
/// Hardware before software. Throws GpuError where there are none.
std::vector<Candidate> find_candidates();

/// Throws GpuError with the reason why it cannot be used.
std::unique_ptr<ContextHandle> open(const Candidate& candidate, bool validation);

/// The first candidate that can be used; where the environment variable LUMIGRAFT_EGL_DEVICE is set, among those whose
/// renderer's name contains it. Throws GpuError with the reason of every one that cannot.
std::unique_ptr<ContextHandle> open_best(bool validation);

}  // namespace lumigraft::relight::gpu::egl
