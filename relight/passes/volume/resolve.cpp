#include "relight/passes/volume/resolve.h"

#include "relight/passes/volume/virtual_area.h"

namespace lumigraft::relight {

Resolve::Resolve(gpu::Device& device) : pipeline_(device.create_compute("resolve.comp")) {}

void Resolve::record(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const {
  params.pass_f.x() = 1.0f / VirtualArea::kUnitsPerFace;
  for (const auto* listed : {&volumes.listed_real, &volumes.listed_virtual}) {  // a voxel in both lists gets the same
                                                                                // value twice
    list.dispatch(
        *pipeline_,
        std::vector<gpu::Binding>{
            gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear), gpu::storage(28, **listed),
            gpu::storage(15, *volumes.virtual_area), gpu::storage(16, *volumes.virtual_flux),
            gpu::storage(17, *volumes.real_flux), gpu::image(18, *volumes.gathered_virtual),
            gpu::sampled(19, *volumes.real_irradiance, gpu::Filter::linear), gpu::image(14, *volumes.real_albedo),
            gpu::image(25, *volumes.real_radiance), gpu::image(26, *volumes.virtual_radiance),
            gpu::image(27, *volumes.real_change), volumes.chunks()},
        gpu::bytes_of(params), kListGroups);
  }
}

}  // namespace lumigraft::relight
