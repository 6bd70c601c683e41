#pragma once
// The virtual surface at each pixel.
// draw: rasterizes triangles into the supersampled targets; in: objects; out: sample_*.
// draw_known: the same for real surfaces of known material; out: known_*.
// resolve: samples in front of the real surface are merged to one surface per pixel; in: sample_*, real_position; out:
// object_normal, object_base, object_surface.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/object_draw.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

/// Parameters common to all draw calls into the camera view, with so many samples per pixel along each axis.
shader::DrawParams camera_view(const shader::FrameParams& frame, int samples);

class ObjectView {
 public:
  explicit ObjectView(gpu::Device& device);
  void draw(gpu::CommandList& list, const shader::FrameParams& params, const std::vector<PlacedObject>& objects,
            bool simple, const gpu::Texture& white, const Screen& screen) const;
  void draw_known(gpu::CommandList& list, const shader::FrameParams& params,
                  const std::vector<StoredModel::Mesh>& surfaces, const gpu::Texture& white,
                  const Screen& screen) const;
  void resolve(gpu::CommandList& list, const shader::FrameParams& params, const Screen& screen) const;

 private:
  std::unique_ptr<gpu::RasterPipeline> raster_;
  std::unique_ptr<gpu::ComputePipeline> resolve_;
};

}  // namespace lumigraft::relight
