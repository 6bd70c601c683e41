#pragma once
// What turns a frame into its relit picture. Plan::method says which: a Relighter (GPU), or the path-traced reference
// (reference/reference_renderer.h), which needs none.
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "reconstruct/scene.h"
#include "relight/exhibit/exhibit.h"
#include "relight/gpu/device.h"
#include "relight/plan.h"

namespace lumigraft::relight {

/// Intermediate maps, filled on request; all at the picture's size. Linear radiance unless said otherwise.
struct RelightMaps {
  capture::Image<float> albedo;   ///< 3 channels, of what is visible
  capture::Image<float> normals;  ///< 3 channels, tag frame
  capture::Image<float> depth_m;  ///< 1 channel, along the camera's z
  capture::Image<float> delta;    ///< 3 channels, signed change of real pixels, W/sr/m²
  capture::Image<float> mask;     ///< 1 channel, coverage by virtual objects
};

struct RelitPicture {
  capture::Image<std::uint8_t> srgb;  ///< R G B, the colour camera's size and response (sRGB)
  Plan plan;
  std::vector<gpu::PassTime> passes;  ///< none where nothing had to be worked out anew
  bool passed_through = false;        ///< the camera picture as it is: a warning says why
  std::vector<std::string> warnings;
  std::shared_ptr<const RelightMaps> maps;  ///< null unless asked for
};

/// One verb. May hold caches; not thread safe. Never throws for what a frame holds: where the scene lacks something (no
/// pose, no light) the camera picture passes through and a warning says why.
class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual RelitPicture relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                               const Plan& plan, bool with_maps = false) = 0;
};

}  // namespace lumigraft::relight
