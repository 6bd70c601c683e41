#include "relight/upload/object_store.h"

#include <algorithm>
#include <array>
#include <set>

#include "relight/exhibit/bsdf_params.h"
#include "relight/objects/distance_field.h"
#include "relight/objects/mesh_refine.h"
#include "relight/objects/mesh_simplify.h"
#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

std::uint8_t to_byte(float x) { return static_cast<std::uint8_t>(std::clamp(x, 0.0f, 1.0f) * 255.0f + 0.5f); }

/// Points distributed over all triangles, each for at most `sample_area_m2` of area.
std::vector<float> surface_samples(const Model& model, double sample_area_m2) {
  std::vector<float> samples;
  for (std::size_t t = 0; t + 2 < model.indices.size(); t += 3) {
    const std::uint32_t* v = &model.indices[t];
    const Eigen::Vector3f &a = model.positions_m[v[0]], &b = model.positions_m[v[1]], &c = model.positions_m[v[2]];
    const float area = 0.5f * (b - a).cross(c - a).norm();
    if (!(area > 0)) continue;
    // A triangle divided into k² equal ones, a sample at each centroid.
    const int k = std::clamp(static_cast<int>(std::ceil(std::sqrt(area / sample_area_m2))), 1, 256);
    for (int i = 0; i < k; ++i) {
      for (int j = 0; j < 2 * (k - i) - 1; ++j) {
        const float u = (static_cast<float>(i) + (j % 2 == 0 ? 1.0f : 2.0f) / 3) / static_cast<float>(k);
        const float w = (static_cast<float>(j / 2) + (j % 2 == 0 ? 1.0f : 2.0f) / 3) / static_cast<float>(k);
        const Eigen::Vector3f p = a + u * (b - a) + w * (c - a);
        const Eigen::Vector3f n = (1 - u - w) * model.normals[v[0]] + u * model.normals[v[1]] + w * model.normals[v[2]];
        samples.insert(samples.end(), {p.x(), p.y(), p.z(), area / static_cast<float>(k * k), n.x(), n.y(), n.z(), 0});
      }
    }
  }
  return samples;
}

double surface_area_m2(const Model& model) {
  double sum = 0;
  for (std::size_t t = 0; t + 2 < model.indices.size(); t += 3) {
    const Eigen::Vector3f& a = model.positions_m[model.indices[t]];
    const Eigen::Vector3f ab = model.positions_m[model.indices[t + 1]] - a,
                          ac = model.positions_m[model.indices[t + 2]] - a;
    sum += 0.5 * ab.cross(ac).norm();
  }
  return sum;
}

/// Subdivides so that no edge is longer than those of even_triangles equal triangles of the same total area.
std::shared_ptr<const Model> evenly_divided(const Model& model) {
  Eigen::AlignedBox3f box;
  for (const auto& p : model.positions_m) box.extend(p);
  const double edge_m = std::sqrt(surface_area_m2(model) / (kUpload.even_triangles * std::sqrt(3.0) / 4));
  const float min_edge_m = box.diagonal().norm() / 200;  // for models of nearly zero area
  return refine_model(model, std::max(static_cast<float>(edge_m), min_edge_m));
}

std::unique_ptr<gpu::Texture> upload_texture(gpu::Device& device, const capture::Image<std::uint8_t>& picture) {
  auto texture = device.create_texture(
      {.name = "base colour", .width = picture.width, .height = picture.height, .format = gpu::Format::rgba8_unorm});
  std::vector<std::uint8_t> texels;
  texels.reserve(static_cast<std::size_t>(picture.width) * picture.height * 4);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      for (int c = 0; c < 3; ++c) texels.push_back(picture.at(x, y, c));
      texels.push_back(255);
    }
  }
  device.upload(*texture, 0, std::as_bytes(std::span(texels)));
  return texture;
}

/// RGBA per voxel: the reflectance of its surface for uniform incident light.
std::vector<std::uint8_t> reflectances(const ObjectField& field, const Model& model) {
  std::vector<std::uint8_t> texels(field.base_color.size() * 4, 255);
  for (std::size_t i = 0; i < field.base_color.size(); ++i) {
    const BsdfParams bsdf = bsdf_params_of(field.base_color[i], model.parts[field.part[i]].material);
    const Eigen::Array3f reflectance = reflectance_evenly(bsdf);
    for (int c = 0; c < 3; ++c) texels[4 * i + static_cast<std::size_t>(c)] = to_byte(reflectance[c]);
  }
  return texels;
}

}  // namespace

gpu::RasterDesc vertex_raster(const char* vertex_shader, const char* fragment_shader,
                              std::vector<gpu::Format> color_formats) {
  return {.vertex_shader = vertex_shader,
          .fragment_shader = fragment_shader,
          .vertex_stride_bytes = kVertexFloats * static_cast<int>(sizeof(float)),
          .attributes = {{0, 3, 0}, {1, 3, 12}, {2, 2, 24}, {3, 3, 32}},
          .color_formats = std::move(color_formats)};
}

bool PlacedObject::operator==(const PlacedObject& o) const {
  return stored == o.stored && T_tag_model.matrix() == o.T_tag_model.matrix() && material == o.material;
}

ObjectStore::ObjectStore(gpu::Device& device) : device_(device) {
  white_ = device.create_texture({.name = "white", .format = gpu::Format::rgba8_unorm});
  const std::array<std::uint8_t, 4> texel{255, 255, 255, 255};
  device.upload(*white_, 0, std::as_bytes(std::span(texel)));
}
StoredModel::Mesh ObjectStore::upload_mesh(const Model& model) {
  std::vector<float> vertices;
  vertices.reserve(model.positions_m.size() * kVertexFloats);
  for (std::size_t i = 0; i < model.positions_m.size(); ++i) {
    const auto &p = model.positions_m[i], &n = model.normals[i], &c = model.colors[i];
    const auto& t = model.texcoords[i];
    vertices.insert(vertices.end(), {p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), t.x(), t.y(), c.x(), c.y(), c.z()});
  }
  StoredModel::Mesh mesh;
  mesh.vertex_count = static_cast<int>(model.positions_m.size());
  mesh.vertices = device_.create_buffer(vertices.size() * sizeof(float), "vertices");
  device_.upload(*mesh.vertices, 0, std::as_bytes(std::span(vertices)));
  for (const auto& part : model.parts) {
    StoredModel::Mesh::Part& p = mesh.parts.emplace_back();
    p.index_count = part.index_count;
    p.material = part.material;
    if (part.index_count == 0) continue;
    p.indices = device_.create_buffer(part.index_count * sizeof(std::uint32_t), "indices");
    device_.upload(*p.indices, 0, std::as_bytes(std::span(model.indices).subspan(part.first_index, part.index_count)));
  }
  return mesh;
}

const StoredModel& ObjectStore::stored(const std::shared_ptr<const Model>& model) {
  auto& entry = models_[model.get()];
  if (entry) return *entry;
  entry = std::make_unique<StoredModel>();
  entry->model = model;
  const std::shared_ptr<const Model> simple = evenly_divided(*simplify_model(*model, kUpload.simple_triangles));
  entry->simple = upload_mesh(*simple);
  try {
    entry->full = upload_mesh(*model);
  } catch (const gpu::DeviceLost&) {
    throw;
  } catch (const gpu::GpuError& e) {
    entry->full = upload_mesh(*simple);
    entry->why_simple = e.what();
  }
  entry->simple.closed = is_closed(*simple);
  entry->rough = upload_mesh(*simplify_model(*model, kUpload.rough_triangles));
  std::map<const capture::Image<std::uint8_t>*, const gpu::Texture*> textures;
  for (std::size_t i = 0; i < model->parts.size(); ++i) {
    const auto& picture = model->parts[i].base_color_texture;
    if (!picture || picture->empty()) continue;
    const gpu::Texture*& texture = textures[picture.get()];
    if (!texture) {
      entry->textures.push_back(upload_texture(device_, *picture));
      texture = entry->textures.back().get();
    }
    if (i < entry->full.parts.size()) entry->full.parts[i].texture = texture;
    if (i < entry->simple.parts.size()) entry->simple.parts[i].texture = texture;
  }
  entry->sphere = bounding_sphere(model->positions_m);

  const std::vector<float> samples = surface_samples(*model, surface_area_m2(*model) / kUpload.samples);
  entry->sample_count = static_cast<int>(samples.size() / 8);
  entry->samples = device_.create_buffer(samples.size() * sizeof(float), "surface samples");
  device_.upload(*entry->samples, 0, std::as_bytes(std::span(samples)));

  const auto field = compute_object_field(*model, kUpload.field_voxels);
  entry->grid_origin_m = field->origin_m;
  entry->grid_voxel_m = field->voxel_m;
  const auto make = [&](const char* name, gpu::Format format) {
    return device_.create_texture(gpu::volume_desc(name, field->size[0], field->size[1], field->size[2], format));
  };
  entry->distance = make("object distance", gpu::Format::r32_float);
  const std::vector<float> distances = full_distances(*field);
  device_.upload(*entry->distance, 0, std::as_bytes(std::span(distances)));

  entry->reflectance = make("object reflectance", gpu::Format::rgba8_unorm);
  const std::vector<std::uint8_t> texels = reflectances(*field, *model);
  device_.upload(*entry->reflectance, 0, std::as_bytes(std::span(texels)));
  return *entry;
}

std::vector<PlacedObject> ObjectStore::place(const Exhibit& exhibit, double time_s) {
  std::vector<PlacedObject> placed;
  std::set<const Model*> kept;
  for (const VirtualObject& object : exhibit.objects) {
    if (!object.model) continue;
    kept.insert(object.model.get());
    if (!object.visible) continue;
    PlacedObject p;
    p.stored = &stored(object.model);
    p.T_tag_model = object.T_tag_model(time_s).cast<float>();
    p.material = object.material;
    const auto scale = static_cast<float>(object.scale);  // exact: the volumes' size must not jitter while it rotates
    p.bounds.sphere = {p.T_tag_model * p.stored->sphere.centre_m, scale * p.stored->sphere.radius_m};
    for (const auto& v : object.model->positions_m) p.bounds.box.extend(p.T_tag_model * v);
    placed.push_back(std::move(p));
  }
  std::erase_if(models_, [&](const auto& entry) { return !kept.contains(entry.first); });
  return placed;
}

}  // namespace lumigraft::relight
