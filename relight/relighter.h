#pragma once
// Renders scene + exhibit + camera frame to the composited frame on a GPU.
#include <memory>

#include "capture/session/session.h"
#include "relight/renderer.h"
#include "relight/upload/upload_model.h"

namespace lumigraft::relight {

/// Caches results that depend only on static geometry, static light or rigid objects. Not thread safe. Never throws
/// because of a frame's content: if the scene lacks something (no pose, no light) the camera frame passes through and a
/// warning gives the reason. Throws gpu::GpuError if the device fails, gpu::DeviceLost if it is lost.
class Relighter : public Renderer {
 public:
  /// `models`: those that the caller prepares on another thread. Objects are not drawn until theirs is, and indirect
  /// light of objects that appear, disappear or jump arrives over frames (AmortizedLightUpdate), of which each
  /// computes a part. Null: `relight` prepares and gathers what a frame lacks.
  Relighter(std::shared_ptr<gpu::Device> device, const capture::Session& session,
            std::shared_ptr<const UploadModels> models = nullptr);
  ~Relighter() override;
  RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                       const Plan& plan, bool with_maps = false) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
