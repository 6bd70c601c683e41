#pragma once
// The path-traced reference as a Renderer: camera frame plus change, without a GPU.
#include <functional>
#include <memory>

#include "capture/session/session.h"
#include "relight/renderer.h"

namespace lumigraft::relight {

struct ReferenceScene;

/// Uses only Plan::samples, the camera paths per pixel. Pixels whose inputs have not changed since the last frame are
/// not traced again: the same paths would give the same result. Objects behind what this frame's depth shows in front
/// of them are hidden in every frame.
class ReferenceRenderer : public Renderer {
 public:
  /// A room without objects from another source than the Scene, with all that is in front of objects; returns the same
  /// pointer while nothing changes.
  using Room = std::function<std::shared_ptr<const ReferenceScene>(const capture::FrameSet&)>;

  /// Throws InputError if a [[real_surface]] cannot be read. `room` empty: uses the Scene's.
  explicit ReferenceRenderer(const capture::Session& session, Room room = {});
  ~ReferenceRenderer() override;
  RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                       const Plan& plan, bool with_maps = false) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
