#include "server/pipeline/make_renderer.h"

#include <utility>

#include "relight/gather/ray_renderer.h"
#include "relight/reference/reference_renderer.h"
#include "relight/relighter.h"
#include "server/truth/reference_truth.h"

namespace lumigraft {

std::unique_ptr<Renderer> make_renderer(const Session& session, const Plan& plan, const OracleParts& truth,
                                        std::shared_ptr<gpu::Device> device) {
  if (plan.method == "rays") return std::make_unique<RayRenderer>(session);
  if (!plan.on_device() && truth.all()) {
    const auto room = std::make_shared<TrueRoom>(session);
    return std::make_unique<ReferenceRenderer>(session, [room](const FrameSet& frame) { return room->at(frame); });
  }
  if (!plan.on_device()) {
    return std::make_unique<ReferenceRenderer>(session);
  }
  return std::make_unique<Relighter>(std::move(device), session);
}

}  // namespace lumigraft
