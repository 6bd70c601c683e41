#pragma once
// Delta final gathering on the CPU as a Renderer: plan.method = rays.
//
// Replaces the cones and volumes of DVCT by rays and keeps the delta formulation: real surfaces get L_Δ, objects L_ρ
// (Franke 2015, §3.2). Camera-independent light is cached on surfaces (§3.1.1.1): irradiance of the objects, its change
// in cells of the room. Rays end in these caches or in the radiance that cameras measured of the room, so one ray
// represents paths of any length. Cells and objects are gathered in rounds, one bounce each, that continue from frame
// to frame; coarse plans update an eighth of them per frame, all of them when the scene is static.
#include <memory>

#include "capture/session/session.h"
#include "relight/gather/irradiance_probes.h"
#include "relight/gather/ray_room.h"
#include "relight/renderer.h"

namespace lumigraft::relight {

/// Uses of the plan: `rays`, `trace_scale` (gather_quality.h), `bounces` (minimum number if there is no previous
/// solution; gathering ends when another bounce is negligible). What has not changed since the last frame is not traced
/// again; a camera motion that moves the objects by less than an eighth of a pixel counts as static.
class RayRenderer : public Renderer {
 public:
  /// Who builds the RayRoom of a scene, which takes some tenths of a second: `relight`, when the scene has changed, or
  /// the caller, who calls `room_of` on another thread and passes the result to `take`. The camera frame passes through
  /// until the first `take`; illumination is updated at once in both cases.
  enum class Rooms { made_here, taken };

  /// `models`: those that the caller prepares on another thread. Objects are not drawn until theirs is; new ones begin
  /// with the light of lamps, and of the environment without occlusion, where the plan updates light over frames. Null:
  /// `relight` prepares and gathers what a frame lacks. Throws InputError if a [[real_surface]] cannot be read.
  explicit RayRenderer(const capture::Session& session, Rooms rooms = Rooms::made_here,
                       std::shared_ptr<const RayModels> models = nullptr);
  ~RayRenderer() override;
  RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                       const Plan& plan, bool with_maps = false) override;

  /// Requires scene.field and scene.illumination. Callable on any thread.
  std::shared_ptr<const RayRoom> room_of(const reconstruct::Scene& scene) const;
  /// Must not run concurrently with `relight`.
  void take(std::shared_ptr<const RayRoom> room);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
