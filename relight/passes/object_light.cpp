#include "relight/passes/object_light.h"

#include <algorithm>

namespace lumigraft {
namespace {

bool is_matt(const Material& material) { return material.specular == 0 && material.metallic == 0; }

}  // namespace

ObjectLight::ObjectLight(gpu::Device& device) : pipeline_(device.create_compute("object_light.comp")) {}

bool ObjectLight::enough_for(const std::vector<PlacedObject>& objects) {
  return std::all_of(objects.begin(), objects.end(), [](const PlacedObject& object) {
    if (object.material) return is_matt(*object.material);
    const auto& parts = object.stored->simple.parts;
    return std::all_of(parts.begin(), parts.end(), [](const auto& part) { return is_matt(part.material); });
  });
}

void ObjectLight::record(gpu::Device& device, gpu::CommandList& list, shader::FrameParams params, int cones,
                         const std::vector<PlacedObject>& objects, const LampMaps& maps, const Volumes& volumes) {
  light_.resize(objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const StoredModel::Mesh& mesh = objects[i].stored->simple;
    const std::size_t bytes = 2 * sizeof(shader::vec4) * static_cast<std::size_t>(mesh.vertex_count);
    if (!light_[i] || light_[i]->size_bytes() < bytes) light_[i] = device.create_buffer(bytes, "light on vertices");
    params.pass_m = objects[i].T_tag_model.matrix();
    params.pass_i << mesh.vertex_count, cones, mesh.closed ? 0 : 1, 0;
    list.dispatch(*pipeline_,
                  joined(joined(volumes.bindings(), maps.bindings()),
                         {gpu::storage(16, *mesh.vertices), gpu::storage(17, *light_[i])}),
                  gpu::bytes_of(params), (mesh.vertex_count + 63) / 64);
  }
}

}  // namespace lumigraft
