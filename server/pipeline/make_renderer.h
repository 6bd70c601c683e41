#pragma once
// The renderer that a plan's method asks for.
#include <memory>

#include "capture/session/session.h"
#include "relight/renderer.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

/// Where all parts of the scene are to be true, the reference takes the true room itself (reference_truth.h) in place
/// of what reconstruct makes of it. `device` may be null where the plan is not drawn on one. Throws InputError,
/// gpu::GpuError.
std::unique_ptr<relight::Renderer> make_renderer(const capture::Session& session, const relight::Plan& plan,
                                                 const OracleParts& truth,
                                                 std::shared_ptr<relight::gpu::Device> device);

}  // namespace lumigraft::server
