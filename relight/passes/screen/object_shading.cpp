#include "relight/passes/screen/object_shading.h"

namespace lumigraft::relight {
namespace {

std::vector<gpu::Binding> shading_inputs(const Volumes& volumes, const Screen& screen) {
  return joined(volumes.bindings(), {gpu::sampled(12, *screen.object_normal), gpu::sampled(13, *screen.object_base),
                                     gpu::sampled(14, *screen.object_surface), gpu::sampled(15, *screen.rays)});
}

}  // namespace

ObjectShading::ObjectShading(gpu::Device& device)
    : ambient_(device.create_compute("ambient.comp")), shade_(device.create_compute("shade.comp")) {}

void ObjectShading::ambient(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes,
                            const Screen& screen) const {
  params.pass_i.x() = screen.ambient_scale;
  dispatch_tiles(list, *ambient_,
                 joined(shading_inputs(volumes, screen),
                        {gpu::image(16, *screen.object_irradiance), gpu::image(17, *screen.object_mirrored),
                         gpu::image(18, *screen.object_open)}),
                 params, screen.tiles->ambients());
}

void ObjectShading::shade(gpu::CommandList& list, shader::FrameParams params, const LampMaps& maps,
                          const Volumes& volumes, const Screen& screen) const {
  params.pass_i.x() = screen.ambient_scale;
  dispatch_tiles(list, *shade_,
                 joined(joined(shading_inputs(volumes, screen), maps.bindings()),
                        {gpu::sampled(17, *screen.object_irradiance), gpu::sampled(18, *screen.object_mirrored),
                         gpu::sampled(19, *screen.object_open), gpu::image(16, *screen.object_radiance)}),
                 params, screen.tiles->objects());
}

}  // namespace lumigraft::relight
