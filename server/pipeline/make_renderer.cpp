#include "server/pipeline/make_renderer.h"

#include <utility>

#include "relight/reference/reference_renderer.h"
#include "relight/relighter.h"
#include "relight/views/ray_renderer.h"
#include "server/truth/reference_truth.h"

namespace lumigraft::server {

std::unique_ptr<relight::Renderer> make_renderer(const capture::Session& session, const relight::Plan& plan,
                                                 const OracleParts& truth,
                                                 std::shared_ptr<relight::gpu::Device> device) {
  if (plan.method == "rays") return std::make_unique<relight::RayRenderer>(session);
  if (!plan.on_device() && truth.all()) {
    const auto room = std::make_shared<TrueRoom>(session);
    return std::make_unique<relight::ReferenceRenderer>(
        session, [room](const capture::FrameSet& frame) { return room->at(frame); });
  }
  if (!plan.on_device()) return std::make_unique<relight::ReferenceRenderer>(session);
  return std::make_unique<relight::Relighter>(std::move(device), session);
}

}  // namespace lumigraft::server
