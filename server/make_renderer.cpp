#include "server/make_renderer.h"

#include <utility>

#include "relight/rays/ray_renderer.h"
#include "relight/reference/reference_renderer.h"
#include "relight/relighter.h"
#include "server/reference_truth.h"

namespace lumigraft {

bool needs_gpu(const Plan& plan) { return plan.method != "reference" && plan.method != "rays"; }

std::unique_ptr<Renderer> make_renderer(const Session& session, const Plan& plan, const OracleParts& truth,
                                        std::shared_ptr<gpu::Device> device) {
  if (plan.method == "rays") return std::make_unique<RayRenderer>(session);
  if (!needs_gpu(plan) && truth.all()) {
    const auto room = std::make_shared<TrueRoom>(session);
    return std::make_unique<ReferenceRenderer>(session, [room](const FrameSet& frame) { return room->at(frame); });
  }
  if (!needs_gpu(plan)) {
    return std::make_unique<ReferenceRenderer>(session);
  }
  return std::make_unique<Relighter>(std::move(device), session);
}

}  // namespace lumigraft
