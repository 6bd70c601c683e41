#include "relight/passes/volume/virtual_area.h"

namespace lumigraft::relight {

VirtualArea::VirtualArea(gpu::Device& device) : pipeline_(device.create_compute("area.comp")) {}

void VirtualArea::record(gpu::CommandList& list, shader::FrameParams params, const std::vector<PlacedObject>& objects,
                         const Volumes& volumes) const {
  list.fill(*volumes.virtual_area, 0);
  for (const PlacedObject& object : objects) {
    const float scale = object.T_tag_model.linear().col(0).norm();
    params.pass_m = object.T_tag_model.matrix();
    params.pass_f.x() = kUnitsPerFace * scale * scale;
    params.pass_i.x() = object.stored->sample_count;
    list.dispatch(*pipeline_,
                  std::vector<gpu::Binding>{gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear),
                                            gpu::storage(16, *object.stored->samples),
                                            gpu::storage(17, *volumes.virtual_area), volumes.chunks()},
                  gpu::bytes_of(params), kListGroups);
  }
}

}  // namespace lumigraft::relight
