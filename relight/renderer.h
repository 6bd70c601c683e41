#pragma once
// Interface of all renderers: a frame in, its relit frame out. Plan::method selects the implementation: a Relighter
// (GPU), final gathering (views/ray_renderer.h) or the path-traced reference (reference/reference_renderer.h), both
// without a GPU.
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "reconstruct/scene.h"
#include "relight/exhibit/exhibit.h"
#include "relight/gpu/device.h"
#include "relight/plan.h"

namespace lumigraft::relight {

/// Intermediate maps, filled on request, at the frame's size. Linear radiance unless noted.
struct RelightMaps {
  capture::Image<float> albedo;   ///< 3 channels, of the visible surface
  capture::Image<float> normals;  ///< 3 channels, tag frame
  capture::Image<float> depth_m;  ///< 1 channel, along the camera's z
  capture::Image<float> delta;    ///< 3 channels, signed change of radiance of real pixels, W/sr/m²
  capture::Image<float> mask;     ///< 1 channel, coverage by virtual objects
};

struct RelitPicture {
  capture::Image<std::uint8_t> srgb;  ///< R G B, size and response (sRGB) of the colour camera
  /// The camera's frame, encoded likewise: `srgb` without objects and change.
  std::shared_ptr<const capture::Image<std::uint8_t>> camera;
  Plan plan;
  std::vector<gpu::PassTime> passes;  ///< empty if nothing was recomputed
  bool passed_through = false;        ///< unmodified camera frame; a warning gives the reason
  std::vector<std::string> warnings;
  std::shared_ptr<const RelightMaps> maps;  ///< null unless requested
};

/// May hold caches; not thread safe. Never throws because of a frame's content: if the scene lacks something (no pose,
/// no light) the camera frame passes through and a warning gives the reason.
class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                               const Plan& plan, bool with_maps = false) = 0;
};

}  // namespace lumigraft::relight
