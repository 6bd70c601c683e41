#pragma once
// Scene + exhibit + camera picture become the composited picture.
#include <memory>

#include "capture/session/session.h"
#include "relight/renderer.h"

namespace lumigraft::relight {

/// One verb. Holds caches of what depends only on still geometry, still light or a rigid object. Not thread safe.
/// Never throws for what a frame holds: where the scene lacks something (no pose, no light) the camera picture passes
/// through and a warning says why. Throws gpu::GpuError where the device fails, gpu::DeviceLost where it is gone.
class Relighter : public Renderer {
 public:
  Relighter(std::shared_ptr<gpu::Device> device, const capture::Session& session);
  ~Relighter() override;
  RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                       const Plan& plan, bool with_maps = false) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
