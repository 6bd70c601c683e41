#pragma once
// Delta final gathering as a Renderer, without a GPU: plan.method = rays.
//
// Rays replace the cones and volumes of DVCT, the delta stays: real surfaces get L_Δ, objects L_ρ (Franke 2015, §3.2).
// Light that does not depend on the camera is kept on surfaces (§3.1.1.1): irradiance of the objects, its change in
// cells of the room. Rays that meet these, or what cameras measured of the room, end there; so one ray stands for paths
// of any length. Cells and objects are gathered in rounds, a bounce each, and go on from one frame to the next; coarse
// plans give new light to an eighth of them in a frame, and all of them have it when things rest.
#include <memory>

#include "capture/session.h"
#include "relight/renderer.h"

namespace lumigraft {

/// Of the plan: `rays`, `trace_scale` (detail.h), `bounces` (rounds where there is nothing to go on from). What has not
/// changed since the last frame is not traced again.
class RayRenderer : public Renderer {
 public:
  /// Throws InputError for a [[real_surface]] that can't be read.
  explicit RayRenderer(const Session& session);
  ~RayRenderer() override;
  RelitPicture relight(const FrameSet& frame, const Scene& scene, const Exhibit& exhibit, const Plan& plan,
                       bool with_maps = false) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft
