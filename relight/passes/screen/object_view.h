#pragma once
// The virtual surface at each pixel, and light on it.
// draw: rasterizes triangles into the supersampled targets; in: objects; out: sample_*.
// draw_known: the same for real surfaces of known material; out: known_*.
// resolve: visible samples are merged to one surface per pixel; in: sample_*, real_position, rays, depth; out:
// object_normal, object_base, object_surface, object_other.
// ambient: slowly varying light, which is the visibility of the lamps and all light except lamps (thesis eq.
// 5.23-5.24); in: all volumes, the resolved surface, rays; out: object_irradiance, object_mirrored, object_open.
// shade: radiance (thesis eq. 5.23-5.25); in: the same, that light, the lamp maps; out: object_radiance.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/lamps/object_draw.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

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
  void ambient(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes, const Screen& screen) const;
  void shade(gpu::CommandList& list, shader::FrameParams params, const LampMaps& maps, const Volumes& volumes,
             const Screen& screen) const;

 private:
  std::unique_ptr<gpu::RasterPipeline> raster_, raster_known_;
  std::unique_ptr<gpu::ComputePipeline> resolve_, ambient_, shade_;
};

}  // namespace lumigraft::relight
