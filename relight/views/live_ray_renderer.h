#pragma once
// Rays for live pictures: light is found on a thread of its own, and pictures do not wait for it if it takes longer
// than their budget. They show the last light that was found as the camera sees it now, and objects where they are now.
// What moves thus has shadows and reflections of a moment ago, and is itself shown at once.
#include <memory>

#include "capture/session/session.h"
#include "relight/gather/irradiance_probes.h"
#include "relight/gather/ray_room.h"
#include "relight/renderer.h"

namespace lumigraft::relight {

class LiveRayRenderer {
 public:
  /// `models`: that the caller prepares on another thread. Objects are not drawn until theirs is; new ones begin with
  /// the light of lamps, and of the environment without occlusion. Throws InputError if a [[real_surface]] cannot be
  /// read.
  LiveRayRenderer(const capture::Session& session, std::shared_ptr<const RayModels> models);
  ~LiveRayRenderer();

  /// As Renderer::relight. With plan.budget_ms = 0, where objects appear or disappear, and after pictures without any,
  /// it waits for the light of this frame. `passes`: those of the picture, and those that were computed for light
  /// since the one before.
  RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                       const Plan& plan);

  /// Whether the last picture's light was found in these surfaces.
  bool shows_surfaces_of(const reconstruct::Scene& scene) const;
  /// The room of a scene with field and illumination, for `take`. Takes some tenths of a second, on any thread.
  std::shared_ptr<const RayRoom> room_of(const reconstruct::Scene& scene) const;
  /// Later calls of `relight` use it; until the first one the camera frame passes through. Must not run concurrently
  /// with `relight`.
  void take(std::shared_ptr<const RayRoom> room);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
