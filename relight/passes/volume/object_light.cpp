#include "relight/passes/volume/object_light.h"

#include <algorithm>
#include <array>

#include "relight/passes/parameters.h"

namespace lumigraft::relight {
namespace {

constexpr int kVerticesAGroup = 64;

/// Whether the light on its vertices is enough.
bool is_matt(const StoredModel::Mesh::Part& part, const MaterialOverride& material) {
  const Material combined = material.over(part.material);
  return combined.layer_specular() == 0 && combined.metallic == 0 && combined.transmission == 0 &&
         combined.clearcoat == 0 && !part.texture(TextureUse::normals).texture;
}

}  // namespace

ObjectLight::ObjectLight(gpu::Device& device)
    : gather_(device.create_compute("object_gather.comp")),
      unoccluded_(device.create_compute("object_unoccluded.comp")),
      light_up_(device.create_compute("object_light.comp")) {}

bool ObjectLight::enough_for(const std::vector<PlacedObject>& objects) {
  return std::all_of(objects.begin(), objects.end(), [](const PlacedObject& object) {
    const auto& parts = object.stored->simple.parts;
    return std::all_of(parts.begin(), parts.end(), [&](const auto& part) { return is_matt(part, object.material); });
  });
}

void ObjectLight::fit(gpu::Device& device, const std::vector<PlacedObject>& objects, VertexLight* light) {
  light->resize(objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::size_t bytes =
        2 * sizeof(shader::vec4) * static_cast<std::size_t>(objects[i].stored->simple.vertex_count);
    auto& buffer = (*light)[i];
    if (!buffer || buffer->size_bytes() < bytes) buffer = device.create_buffer(bytes, "light on vertices");
  }
}

void ObjectLight::gather(gpu::CommandList& list, shader::FrameParams params, int cones, Slice slice,
                         const std::vector<PlacedObject>& objects, const LampMaps& maps, const Volumes& volumes,
                         const VertexLight& gathered) const {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const StoredModel::Mesh& mesh = objects[i].stored->simple;
    const int groups = (mesh.vertex_count + kVerticesAGroup - 1) / kVerticesAGroup;
    const int first = groups * slice.number / slice.of, last = groups * (slice.number + 1) / slice.of;
    if (first == last) continue;
    params.pass_m = objects[i].T_tag_model.matrix();
    params.pass_i << mesh.vertex_count, cones, mesh.closed ? 0 : 1, kVerticesAGroup * first;
    list.dispatch(*gather_,
                  joined(joined(volumes.bindings(), maps.bindings()),
                         {gpu::storage(16, *mesh.vertices), gpu::storage(17, *gathered[i])}),
                  gpu::bytes_of(params), last - first);
  }
}

void ObjectLight::unoccluded(gpu::CommandList& list, shader::FrameParams params, const PlacedObject& object,
                             const gpu::Buffer& gathered) const {
  const StoredModel::Mesh& mesh = object.stored->simple;
  params.counts.x() = 0;  // lamps are added by `record`
  params.pass_m = object.T_tag_model.matrix();
  params.pass_i << mesh.vertex_count, 0, 0, 0;
  const std::array bindings{gpu::storage(16, *mesh.vertices), gpu::storage(17, gathered)};
  list.dispatch(*unoccluded_, bindings, gpu::bytes_of(params),
                (mesh.vertex_count + kVerticesAGroup - 1) / kVerticesAGroup);
}

void ObjectLight::record(gpu::Device& device, gpu::CommandList& list, shader::FrameParams params,
                         const std::vector<const gpu::Buffer*>& older, const std::vector<const gpu::Buffer*>& newer,
                         float newer_weight, const std::vector<PlacedObject>& objects, const LampMaps& maps,
                         const Volumes& volumes) {
  fit(device, objects, &light_);
  params.pass_f.x() = newer_weight;
  params.counts.w() = kPasses.shadow_cones;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const StoredModel::Mesh& mesh = objects[i].stored->simple;
    params.pass_m = objects[i].T_tag_model.matrix();
    params.pass_i << mesh.vertex_count, 0, mesh.closed ? 0 : 1, 0;
    list.dispatch(*light_up_,
                  joined(maps.bindings(),
                         {gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear),
                          gpu::sampled(2, *volumes.real_distance, gpu::Filter::linear), volumes.gone(),
                          gpu::storage(16, *mesh.vertices), gpu::storage(17, *light_[i]),
                          gpu::storage(18, *(newer_weight < 1 ? older : newer)[i]), gpu::storage(19, *newer[i])}),
                  gpu::bytes_of(params), (mesh.vertex_count + kVerticesAGroup - 1) / kVerticesAGroup);
  }
}

}  // namespace lumigraft::relight
