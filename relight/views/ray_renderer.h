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
#include "relight/renderer.h"

namespace lumigraft::relight {

/// Uses of the plan: `rays`, `trace_scale` (gather_quality.h), `bounces` (minimum number if there is no previous
/// solution; gathering ends when another bounce is negligible). What has not changed since the last frame is not traced
/// again; a camera motion that moves the objects by less than an eighth of a pixel counts as static.
class RayRenderer : public Renderer {
 public:
  /// `relight` builds the RayRoom of a scene, when it has changed, and prepares the exhibit's models. Throws InputError
  /// if a [[real_surface]] cannot be read.
  explicit RayRenderer(const capture::Session& session);
  ~RayRenderer() override;
  RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                       const Plan& plan, bool with_maps = false) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
