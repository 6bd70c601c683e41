#pragma once
// The live setting's frame: all light that does not depend on the camera was gathered before (lamp shadows, light at
// vertices, the volumes' cells) and is looked up; only glossy real surfaces of known material are traced (RealChange).
// In: the volumes, the lamp maps, rays, depth, codes. Out: live_gain, object_layer and object_z where objects may be
// visible or cast shadows; gain elsewhere.
#include "relight/passes/screen/lamp_shadows.h"
#include "relight/passes/screen/object_view.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/object_light.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class LiveView {
 public:
  explicit LiveView(gpu::Device& device);

  /// Rasterizes matt objects with their light into `lit_samples`.
  void draw_objects(gpu::CommandList& list, const shader::FrameParams& params, const std::vector<PlacedObject>& objects,
                    const ObjectLight& light, const gpu::Texture& white, const Screen& screen) const;
  /// real_position in the tiles that objects may cover.
  void place(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes,
             const Screen& screen) const;
  /// Computes gain and live_gain. `samples`: objects come from lit_samples, else from object_radiance and
  /// object_surface. `irradiance`: its change in the cells of the volumes; applied where it can change params.pass_f.x
  /// pixel values (8 bit) or more.
  void compose(gpu::CommandList& list, shader::FrameParams params, const LampShadows& shadows, const LampMaps& maps,
               bool samples, const Volumes& volumes, const gpu::Texture& irradiance, const Screen& screen) const;

  /// real_position, real_normal, real_albedo, mirror_lost, mirror_all and `indirect`, the change of their diffuse part,
  /// where glossy surfaces may be visible. In: known_depth, radiance.
  void see_gloss(gpu::CommandList& list, const shader::FrameParams& params, const LampShadows& shadows,
                 const LampMaps& maps, const Volumes& volumes, const gpu::Texture& irradiance,
                 const Screen& screen) const;
  /// Adds the results of RealChange::reflect there; after compose.
  void add_gloss(gpu::CommandList& list, shader::FrameParams params, const Screen& screen) const;

 private:
  std::unique_ptr<gpu::RasterPipeline> raster_;
  std::unique_ptr<gpu::ComputePipeline> place_, gain_, shadow_, object_, blend_, see_gloss_, gloss_;
};

}  // namespace lumigraft::relight
