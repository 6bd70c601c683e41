#include "relight/passes/volume/enclosure.h"

#include <utility>

#include "relight/passes/parameters.h"

namespace lumigraft::relight {
EnclosureLight::EnclosureLight(gpu::Device& device)
    : light_(device.create_compute("enclosure_light.comp")), change_(device.create_compute("enclosure_change.comp")) {}

void EnclosureLight::light(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const {
  params.pass_i.x() = kPasses.enclosure_cones;
  dispatch_2d(list, *light_,
              joined(volumes.bindings(),
                     {gpu::image(18, *volumes.enclosure_response), gpu::image(19, *volumes.enclosure_lost)}),
              params, kPasses.enclosure_texels, kPasses.enclosure_texels);
}

void EnclosureLight::change(gpu::CommandList& list, shader::FrameParams params, Volumes& volumes) const {
  params.pass_i.x() = kPasses.enclosure_cones;
  dispatch_2d(list, *change_,
              joined(volumes.bindings(), {gpu::sampled(12, *volumes.enclosure_response, gpu::Filter::nearest),
                                          gpu::sampled(13, *volumes.enclosure_lost, gpu::Filter::nearest),
                                          gpu::image(18, *volumes.enclosure_change_before)}),
              params, kPasses.enclosure_texels, kPasses.enclosure_texels);
  std::swap(volumes.enclosure_change, volumes.enclosure_change_before);
}

}  // namespace lumigraft::relight
