#pragma once
// The renderer of a plan's method.
#include <memory>

#include "capture/session/session.h"
#include "relight/renderer.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

/// If `oracle` provides all parts of the scene, the reference renders the session's true room (reference_truth.h)
/// instead of the reconstruction. `device` may be null if the plan's method needs none. Throws InputError,
/// gpu::GpuError.
std::unique_ptr<relight::Renderer> make_renderer(const capture::Session& session, const relight::Plan& plan,
                                                 const OracleParts& truth,
                                                 std::shared_ptr<relight::gpu::Device> device);

}  // namespace lumigraft::server
