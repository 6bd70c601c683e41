#pragma once
// The path-traced reference as a Renderer: camera picture plus change, without a GPU.
#include <functional>
#include <memory>

#include "capture/session/session.h"
#include "relight/renderer.h"

namespace lumigraft::relight {

struct ReferenceScene;

/// Plan::samples camera paths a pixel; all else of the plan means nothing here. What stands still since the last frame
/// is not traced again: the same paths would give the same picture.
class ReferenceRenderer : public Renderer {
 public:
  /// A room without objects, known from elsewhere than the Scene; the same pointer as long as nothing has changed.
  using Room = std::function<std::shared_ptr<const ReferenceScene>(const capture::FrameSet&)>;

  /// Throws InputError for a [[real_surface]] that can't be read. `room` empty: the Scene's.
  explicit ReferenceRenderer(const capture::Session& session, Room room = {});
  ~ReferenceRenderer() override;
  RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                       const Plan& plan, bool with_maps = false) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
