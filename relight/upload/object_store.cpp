#include "relight/upload/object_store.h"

#include <algorithm>
#include <array>
#include <set>

#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

std::unique_ptr<gpu::Texture> upload_texture(gpu::Device& device, gpu::Format format,
                                             const capture::Image<std::uint8_t>& picture,
                                             const std::vector<std::vector<std::uint8_t>>& levels) {
  auto texture = device.create_texture({.name = "texture of an object",
                                        .width = picture.width,
                                        .height = picture.height,
                                        .mips = static_cast<int>(levels.size()),
                                        .format = format});
  for (std::size_t mip = 0; mip < levels.size(); ++mip) {
    device.upload(*texture, static_cast<int>(mip), std::as_bytes(std::span(levels[mip])));
  }
  return texture;
}

std::size_t mesh_bytes(const Model& model) {
  return model.positions_m.size() * kVertexFloats * sizeof(float) + model.indices.size() * sizeof(std::uint32_t);
}

template <typename Value>
std::unique_ptr<gpu::Texture> upload_grid(gpu::Device& device, const char* name, gpu::Format format,
                                          const std::array<int, 3>& size, const std::vector<Value>& values) {
  auto texture = device.create_texture(gpu::volume_desc(name, size[0], size[1], size[2], format));
  device.upload(*texture, 0, std::as_bytes(std::span(values)));
  return texture;
}

void describe(const UploadModel& from, StoredModel& to) {
  to.sphere = from.sphere;
  to.area_m2 = from.area_m2;
  to.volume_m3 = from.volume_m3;
  to.part_area_m2 = from.part_area_m2;
  to.mean_emission = from.mean_emission;
  to.shown = from.full;
}

void upload_samples(gpu::Device& device, const UploadModel& from, StoredModel& to) {
  to.sample_count = static_cast<int>(from.samples.size() / kSampleFloats);
  to.samples = device.create_buffer(from.samples.size() * sizeof(float), "surface samples");
  device.upload(*to.samples, 0, std::as_bytes(std::span(from.samples)));
}

void upload_distances(gpu::Device& device, const UploadModel& from, StoredModel::Grid& to) {
  to.origin_m = from.grid_origin_m;
  to.voxel_m = from.grid_voxel_m;
  to.distance = upload_grid(device, "object distance", gpu::Format::r32_float, from.grid, from.distances_m);
}

void upload_reflectances(gpu::Device& device, const UploadModel& from, StoredModel::Grid& to) {
  to.reflectance = upload_grid(device, "object reflectance", gpu::Format::rgba8_unorm, from.grid, from.reflectances);
}

}  // namespace

gpu::RasterDesc vertex_raster(const char* vertex_shader, const char* fragment_shader,
                              std::vector<gpu::Format> color_formats) {
  return {.vertex_shader = vertex_shader,
          .fragment_shader = fragment_shader,
          .vertex_stride_bytes = kVertexFloats * static_cast<int>(sizeof(float)),
          .attributes = {{0, 3, 0}, {1, 3, 12}, {2, 4, 24}, {3, 3, 40}, {4, 4, 52}},
          .color_formats = std::move(color_formats)};
}

bool PlacedObject::operator==(const PlacedObject& o) const {
  return stored == o.stored && T_tag_model.matrix() == o.T_tag_model.matrix() && material == o.material &&
         white_radiance == o.white_radiance;
}

bool same_models(const std::vector<PlacedObject>& a, const std::vector<PlacedObject>& b) {
  const auto model_of = [](const PlacedObject& o) { return o.stored->model.get(); };
  return std::ranges::equal(a, b, {}, model_of, model_of);
}

ObjectStore::ObjectStore(gpu::Device& device) : device_(device) {
  white_ = device.create_texture({.name = "white", .format = gpu::Format::rgba8_unorm});
  const std::array<std::uint8_t, 4> texel{255, 255, 255, 255};
  device.upload(*white_, 0, std::as_bytes(std::span(texel)));
}

void StoredModel::Mesh::Part::set_texture(const std::pair<const capture::Image<std::uint8_t>*, Texels>& key,
                                          const gpu::Texture& texture) {
  for (const TextureUse use : kTextureUses) {
    PlacedTexture& placed = textures[static_cast<std::size_t>(use)];
    if (placed.slot.picture.get() == key.first && texels_of(use) == key.second) placed.texture = &texture;
  }
}

std::unique_ptr<gpu::Buffer> ObjectStore::upload_vertices(const Model& model) {
  std::vector<float> vertices;
  vertices.reserve(model.positions_m.size() * kVertexFloats);
  for (std::size_t i = 0; i < model.positions_m.size(); ++i) {
    const auto &p = model.positions_m[i], &n = model.normals[i], &c = model.colors[i];
    const auto& t = model.texcoords[i];
    const Eigen::Vector2f second = model.texcoords_1.empty() ? Eigen::Vector2f(0, 0) : model.texcoords_1[i];
    const Eigen::Vector4f along = model.tangents.empty() ? Eigen::Vector4f(0, 0, 0, 0) : model.tangents[i];
    vertices.insert(vertices.end(), {p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), t.x(), t.y(), second.x(), second.y(),
                                     c.x(), c.y(), c.z(), along.x(), along.y(), along.z(), along.w()});
  }
  auto buffer = device_.create_buffer(vertices.size() * sizeof(float), "vertices");
  device_.upload(*buffer, 0, std::as_bytes(std::span(vertices)));
  return buffer;
}

StoredModel::Mesh ObjectStore::posed_mesh(const StoredModel::Mesh& at_rest, const Model& posed) {
  StoredModel::Mesh mesh;
  mesh.vertices = upload_vertices(posed);
  mesh.vertex_count = at_rest.vertex_count;
  mesh.closed = at_rest.closed;
  mesh.parts = at_rest.parts;
  return mesh;
}

StoredModel::Mesh ObjectStore::upload_mesh(const Model& model) {
  StoredModel::Mesh mesh;
  mesh.vertex_count = static_cast<int>(model.positions_m.size());
  mesh.vertices = upload_vertices(model);
  for (const auto& part : model.parts) {
    StoredModel::Mesh::Part& p = mesh.parts.emplace_back();
    p.index_count = part.index_count;
    p.material = part.material;
    p.metallic_factor = part.metallic_factor;
    p.roughness_factor = part.roughness_factor;
    p.normal_scale = part.normal_scale;
    p.transmission_factor = part.transmission_factor;
    p.clearcoat_factor = part.clearcoat_factor;
    p.clearcoat_roughness_factor = part.clearcoat_roughness_factor;
    for (const TextureUse use : kTextureUses) p.textures[static_cast<std::size_t>(use)].slot = slot_of(part, use);
    if (part.index_count == 0) continue;
    p.indices = device_.create_buffer(part.index_count * sizeof(std::uint32_t), "indices");
    device_.upload(*p.indices, 0, std::as_bytes(std::span(model.indices).subspan(part.first_index, part.index_count)));
  }
  return mesh;
}

std::deque<ObjectStore::Upload> ObjectStore::uploads(const std::shared_ptr<const UploadModel>& from, StoredModel& to) {
  std::deque<Upload> all;
  all.push_back({mesh_bytes(*from->simple), [this, from, &to] {
                   to.simple = upload_mesh(*from->simple);
                   to.simple.closed = from->closed;
                 }});
  all.push_back({mesh_bytes(*to.model), [this, from, &to] {
                   try {
                     to.full = upload_mesh(*to.model);
                   } catch (const gpu::DeviceLost&) {
                     throw;
                   } catch (const gpu::GpuError& e) {
                     to.full = upload_mesh(*from->simple);
                     to.why_simple = e.what();
                   }
                 }});
  all.push_back({mesh_bytes(*from->rough), [this, from, &to] { to.rough = upload_mesh(*from->rough); }});
  for (const auto& [key, levels] : from->textures) {
    all.push_back({levels[0].size(), [this, from, &to, key = key] {
                     to.textures.push_back(upload_texture(
                         device_, key.second == Texels::srgb ? gpu::Format::rgba8_srgb : gpu::Format::rgba8_unorm,
                         *key.first, from->textures.at(key)));
                     for (StoredModel::Mesh* mesh : {&to.full, &to.simple}) {
                       for (StoredModel::Mesh::Part& part : mesh->parts) part.set_texture(key, *to.textures.back());
                     }
                   }});
  }
  all.push_back({from->samples.size() * sizeof(float), [this, from, &to] { upload_samples(device_, *from, to); }});
  all.push_back({from->distances_m.size() * sizeof(float),
                 [this, from, &to] { upload_distances(device_, *from, to.made_grid); }});
  all.push_back({from->reflectances.size(), [this, from, &to] { upload_reflectances(device_, *from, to.made_grid); }});
  return all;
}

ObjectStore::Entry& ObjectStore::entry_of(const std::shared_ptr<const Model>& model,
                                          const std::shared_ptr<const UploadModel>& prepared) {
  Entry& entry = models_[model.get()];
  if (entry.stored) return entry;
  entry.stored = std::make_shared<StoredModel>();
  entry.stored->model = without_blending(model);
  if (model->rig) entry.stored->prepared = prepared;
  describe(*prepared, *entry.stored);
  for (const Model::Part& part : entry.stored->model->parts)
    entry.stored->max_emission = entry.stored->max_emission.cwiseMax(part.material.emission);
  entry.uploads = uploads(prepared, *entry.stored);
  return entry;
}

/// Returns its size in bytes.
std::size_t ObjectStore::upload_next(Entry& entry) {
  entry.uploads.front().run();
  const std::size_t bytes = entry.uploads.front().bytes;
  entry.uploads.pop_front();
  return bytes;
}

const std::shared_ptr<StoredModel>& ObjectStore::stored(const std::shared_ptr<const Model>& model) {
  const auto found = models_.find(model.get());
  Entry& entry = found != models_.end() ? found->second : entry_of(model, make_upload_model(model));
  while (!entry.uploads.empty()) upload_next(entry);
  return entry.stored;
}

/// Of the last frame, if it is the same.
std::shared_ptr<const StoredModel> ObjectStore::posed(const std::shared_ptr<const StoredModel>& at_rest, RigPose pose) {
  const auto known =
      std::ranges::find_if(posed_, [&](const auto& of) { return of->at_rest == at_rest && of->pose == pose; });
  if (known != posed_.end()) return *known;
  const std::shared_ptr<const UploadModel> from = posed_upload_model(*at_rest->prepared, pose);
  auto to = std::make_shared<StoredModel>();
  to->model = at_rest->model;
  to->pose = std::move(pose);
  to->at_rest = at_rest;
  to->max_emission = at_rest->max_emission;
  to->why_simple = at_rest->why_simple;
  describe(*from, *to);
  to->full = posed_mesh(at_rest->full, at_rest->why_simple.empty() ? *from->full : *from->simple);
  to->simple = posed_mesh(at_rest->simple, *from->simple);
  to->rough = posed_mesh(at_rest->rough, *from->rough);
  upload_samples(device_, *from, *to);
  to->make_grid = [&device = device_, from](StoredModel::Grid& grid) {
    const std::shared_ptr<const UploadModel> complete = with_field(*from);
    upload_distances(device, *complete, grid);
    upload_reflectances(device, *complete, grid);
  };
  return to;
}

Exhibit ObjectStore::ready(const Exhibit& exhibit, const UploadModels& models, std::vector<std::string>* preparing) {
  Exhibit ready = only_prepared(exhibit, models, preparing);
  std::size_t bytes = 0;
  for (VirtualObject& object : ready.objects) {
    if (!object.visible || !object.model) continue;
    const auto prepared = models.find(object.model);
    if (prepared) {
      Entry& entry = entry_of(object.model, prepared);
      while (!entry.uploads.empty() && (bytes == 0 || bytes + entry.uploads.front().bytes <= kUpload.frame_bytes))
        bytes += upload_next(entry);
      if (entry.uploads.empty()) continue;
    }
    object.visible = false;
    preparing->push_back(object.name);
  }
  return ready;
}

std::vector<PlacedObject> ObjectStore::place(const Exhibit& exhibit, double time_s) {
  std::vector<PlacedObject> placed;
  std::set<const Model*> kept;
  std::vector<std::shared_ptr<const StoredModel>> poses;
  for (const VirtualObject& object : exhibit.objects) {
    if (!object.model) continue;
    kept.insert(object.model.get());
    if (!object.visible) continue;
    PlacedObject p;
    p.stored = stored(object.model);
    float radius_m = p.stored->sphere.radius_m;
    if (RigPose pose = object.pose(time_s); !pose.at_rest()) {
      const std::vector<float>& radii_m = p.stored->prepared->animation_radii_m;
      p.stored = poses.emplace_back(posed(p.stored, std::move(pose)));
      radius_m = std::max(p.stored->sphere.radius_m, radii_m[object.animation->index]);
    }
    p.T_tag_model = object.T_tag_model(time_s).cast<float>();
    p.material = object.material;
    p.white_radiance = object.white_radiance;
    const auto scale = static_cast<float>(object.scale);  // exact: the volumes' size must not jitter while it rotates
    p.bounds.sphere = {p.T_tag_model * p.stored->sphere.centre_m, scale * radius_m};
    for (const auto& v : p.stored->shown->positions_m) p.bounds.box.extend(p.T_tag_model * v);
    p.bounds.emission = p.emission().maxCoeff() / p.white_radiance;
    placed.push_back(std::move(p));
  }
  posed_ = std::move(poses);
  std::erase_if(models_, [&](const auto& entry) { return !kept.contains(entry.first); });
  return placed;
}

}  // namespace lumigraft::relight
