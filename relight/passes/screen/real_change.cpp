#include "relight/passes/screen/real_change.h"

#include "relight/passes/parameters.h"

namespace lumigraft::relight {

RealChange::RealChange(gpu::Device& device)
    : matt_(device.create_compute("shadow.comp")),
      glossy_(device.create_compute("shadow_glossy.comp")),
      trace_(device.create_compute("trace.comp")),
      upsample_(device.create_compute("upsample.comp")),
      reflect_(device.create_compute("reflect.comp")),
      smooth_(device.create_compute("mirror_smooth.comp")) {}

void RealChange::shadow(gpu::CommandList& list, shader::FrameParams params, bool glossy, bool by_mirrors,
                        const LampMaps& maps, const Volumes& volumes, const Screen& screen) const {
  params.pass_i << screen.shadow_scale, by_mirrors ? kPasses.mirror_samples * params.counts.w() : 0, 0, 0;
  std::vector<gpu::Binding> bindings =
      joined(joined(volumes.bindings(), maps.bindings()),
             {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
              gpu::sampled(15, *screen.object_surface),
              gpu::image(16, screen.shadow_scale > 1 ? *screen.shadowed : *screen.direct_lost)});
  if (glossy) {
    bindings = joined(bindings, {gpu::sampled(14, *screen.real_albedo), gpu::image(17, *screen.mirror_lost),
                                 gpu::image(18, *screen.mirror_all)});
  }
  dispatch_tiles(list, glossy ? *glossy_ : *matt_, bindings, params, screen.tiles->shadows());
}

void RealChange::trace(gpu::CommandList& list, shader::FrameParams params, int change_cones, const Volumes& volumes,
                       const Screen& screen) const {
  params.pass_i.x() = change_cones;
  dispatch_tiles(
      list, *trace_,
      joined(volumes.bindings(), {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                                  gpu::sampled(14, *screen.object_surface), gpu::sampled(15, *screen.real_albedo),
                                  gpu::image(16, *screen.traced)}),
      params, screen.tiles->traces());
}

void RealChange::upsample(gpu::CommandList& list, shader::FrameParams params, const Screen& screen,
                          const TileList& tiles, const gpu::Texture& coarse, const gpu::Texture& smooth, int scale,
                          int window) const {
  params.picture.z() = scale;
  params.pass_i.x() = window;
  params.pass_f.x() = 0.7f * static_cast<float>(window) + 0.3f;  // the Gaussian falls to a tenth at the window's edge
  dispatch_tiles(list, *upsample_,
                 {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                  gpu::sampled(14, coarse), gpu::image(16, smooth)},
                 params, tiles);
}

void RealChange::reflect(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes,
                         const Screen& screen) const {
  const std::vector<gpu::Binding> bindings =
      joined(volumes.bindings(), {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                                  gpu::sampled(14, *screen.real_albedo), gpu::sampled(15, *screen.object_surface),
                                  gpu::sampled(25, *screen.mirror_lost), gpu::sampled(17, *screen.mirror_all),
                                  gpu::sampled(26, *screen.radiance), gpu::image(18, *screen.mirror_gained),
                                  gpu::image(19, *screen.mirror_fraction)});
  // Blocks of the coarse list overlap those of the fine one, which run later and overwrite.
  params.pass_i.x() = kPasses.blurred_px;
  dispatch_tiles(list, *reflect_, bindings, params, screen.tiles->blurred());
  params.pass_i.x() = 1;
  dispatch_tiles(list, *reflect_, bindings, params, screen.tiles->sharp());
  dispatch_tiles(list, *smooth_,
                 joined(volumes.bindings(),
                        {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                         gpu::sampled(14, *screen.real_albedo), gpu::sampled(15, *screen.mirror_gained),
                         gpu::sampled(17, *screen.mirror_fraction), gpu::image(18, *screen.mirror_gained_smooth),
                         gpu::image(19, *screen.mirror_fraction_smooth)}),
                 params, screen.tiles->glossy());
}

}  // namespace lumigraft::relight
