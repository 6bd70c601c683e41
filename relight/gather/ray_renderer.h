#pragma once
// Delta final gathering as a Renderer, without a GPU: plan.method = rays.
//
// Rays replace the cones and volumes of DVCT, the delta stays: real surfaces get L_Δ, objects L_ρ (Franke 2015, §3.2).
// Light that does not depend on the camera is kept on surfaces (§3.1.1.1): irradiance of the objects, its change in
// cells of the room. Rays that meet these, or what cameras measured of the room, end there; so one ray stands for paths
// of any length. Cells and objects are gathered in rounds, a bounce each, and go on from one frame to the next; coarse
// plans give new light to an eighth of them in a frame, and all of them have it when things rest.
#include <memory>

#include "capture/session/session.h"
#include "relight/gather/ray_room.h"
#include "relight/renderer.h"

namespace lumigraft::relight {

/// Of the plan: `rays`, `trace_scale` (detail.h), `bounces` (where there is nothing to go on from, at least so many:
/// they end when one more brings next to nothing). What has not changed since the last frame is not traced again; a
/// camera that moves the objects by less than an eighth of a pixel stands still.
class RayRenderer : public Renderer {
 public:
  /// Who makes of a scene what rays meet, which takes some tenths of a second: `relight`, when the scene has changed,
  /// or others, who call `room_of` on a thread of their own and `take` the result. Until the first is taken the camera
  /// picture passes through; light is followed at once all the same.
  enum class Rooms { made_here, taken };

  /// Throws InputError for a [[real_surface]] that can't be read.
  explicit RayRenderer(const capture::Session& session, Rooms rooms = Rooms::made_here);
  ~RayRenderer() override;
  RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                       const Plan& plan, bool with_maps = false) override;

  /// Needs scene.field and scene.illumination. Any thread.
  std::shared_ptr<const RayRoom> room_of(const reconstruct::Scene& scene) const;
  /// Between calls of `relight`.
  void take(std::shared_ptr<const RayRoom> room);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
