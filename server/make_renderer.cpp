#include "server/make_renderer.h"

#include <utility>

#include "relight/reference/reference_renderer.h"
#include "relight/relighter.h"

namespace lumigraft {

bool needs_gpu(const Plan& plan) { return plan.method != "reference"; }

std::unique_ptr<Renderer> make_renderer(const Session& session, const Plan& plan, std::shared_ptr<gpu::Device> device) {
  if (!needs_gpu(plan)) {
    return std::make_unique<ReferenceRenderer>(session);
  }
  return std::make_unique<Relighter>(std::move(device), session);
}

}  // namespace lumigraft
