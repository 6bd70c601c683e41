#include "relight/exhibit/model_builder.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <utility>

namespace lumigraft::relight {
namespace {

/// Corners to vertices and indices, of a model that has its parts.
void join(const std::vector<Corner>& corners, Model* model) {
  model->indices.resize(corners.size());
  const std::size_t vertices = meshopt_generateVertexRemap(model->indices.data(), nullptr, corners.size(),
                                                           corners.data(), corners.size(), sizeof(Corner));
  model->positions_m.resize(vertices);
  model->normals.resize(vertices);
  model->texcoords.resize(vertices);
  model->colors.resize(vertices);
  if (std::any_of(model->parts.begin(), model->parts.end(), reads_second_texcoords))
    model->texcoords_1.resize(vertices);
  if (std::any_of(corners.begin(), corners.end(), [](const Corner& c) { return c.handedness != 0; }))
    model->tangents.resize(vertices);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Corner& corner = corners[i];
    const std::uint32_t v = model->indices[i];
    model->positions_m[v] = corner.position_m;
    model->normals[v] = corner.normal;
    model->texcoords[v] = corner.texcoords[0];
    model->colors[v] = corner.color;
    if (!model->texcoords_1.empty()) model->texcoords_1[v] = corner.texcoords[1];
    if (!model->tangents.empty()) model->tangents[v] << corner.tangent, corner.handedness;
    if (corner.source == Corner::kNoSource) continue;
    model->sources.resize(vertices);
    model->sources[v] = corner.source;
  }
}

}  // namespace

bool reads_second_texcoords(const Model::Part& part) {
  return part.base_color_texture.texcoord_set == 1 || part.metallic_roughness_texture.texcoord_set == 1 ||
         part.normal_texture.texcoord_set == 1 || part.emissive_texture.texcoord_set == 1 ||
         part.transmission_texture.texcoord_set == 1 || part.clearcoat_texture.texcoord_set == 1 ||
         part.clearcoat_roughness_texture.texcoord_set == 1 || part.clearcoat_normal_texture.texcoord_set == 1 ||
         part.specular_texture.texcoord_set == 1 || part.specular_color_texture.texcoord_set == 1 ||
         part.sheen_color_texture.texcoord_set == 1 || part.sheen_roughness_texture.texcoord_set == 1 ||
         part.anisotropy_texture.texcoord_set == 1 || part.opacity_texture.texcoord_set == 1;
}

Eigen::Matrix3f up_to_z(char up) {
  Eigen::Matrix3f rotation = Eigen::Matrix3f::Identity();
  if (up == 'x') rotation << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  if (up == 'y') rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return rotation;
}

ModelBuilder::Mesh::Mesh(ModelBuilder& builder, std::vector<Corner>& corners, std::vector<Corner> vertices,
                         bool mirrors)
    : builder_(builder), corners_(corners), first_(corners.size()), vertices_(std::move(vertices)), mirrors_(mirrors) {}

void ModelBuilder::Mesh::add(std::size_t a, std::size_t b, std::size_t c) {
  if (mirrors_) std::swap(a, c);
  const bool exist = std::max({a, b, c}) < vertices_.size();
  if (exist && is_usable(vertices_[a], vertices_[b], vertices_[c]))
    corners_.insert(corners_.end(), {vertices_[a], vertices_[b], vertices_[c]});
  else
    ++builder_.unusable_triangles_;
}

std::span<Corner> ModelBuilder::Mesh::finish() {
  const std::span<Corner> corners = std::span(corners_).subspan(first_);
  fill_missing_normals(corners);
  return corners;
}

std::vector<Corner>& ModelBuilder::room_for(std::size_t material, std::size_t triangles) {
  std::vector<Corner>& corners = corners_[material];
  const std::size_t needed = corners.size() + 3 * triangles;
  if (needed > corners.capacity()) corners.reserve(std::max(needed, 2 * corners.capacity()));
  return corners;
}

ModelBuilder::Mesh ModelBuilder::mesh(std::size_t material, std::vector<Corner> vertices, std::size_t triangles,
                                      const Eigen::Affine3f& T_model_mesh) {
  const CornerTransform to_model(T_model_mesh);
  for (Corner& vertex : vertices) vertex = to_model(vertex);
  return {*this, room_for(material, triangles), std::move(vertices), to_model.mirrors()};
}

ModelBuilder::Mesh ModelBuilder::mesh_at_rest(std::size_t material, std::vector<Corner> vertices, std::size_t triangles,
                                              bool mirrors) {
  return {*this, room_for(material, triangles), std::move(vertices), mirrors};
}

void ModelBuilder::cut_out(const std::map<std::size_t, AlphaMask>& masks, SourceMixes& mixes) {
  std::map<std::size_t, std::vector<Corner>> left;
  for (const auto& [material, corners] : corners_) {
    const auto mask = masks.find(material);
    if (mask != masks.end()) left[material] = relight::cut_out(corners, mask->second, mixes);
  }
  const bool any = std::ranges::any_of(
      corners_, [&](const auto& of) { return !(left.contains(of.first) ? left.at(of.first) : of.second).empty(); });
  if (!any) return;
  for (auto& [material, corners] : left) corners_[material] = std::move(corners);
}

std::shared_ptr<Model> ModelBuilder::build(const std::function<Model::Part(std::size_t material)>& part_of) {
  auto model = std::make_shared<Model>();
  std::vector<Corner> all;
  for (auto& [material, corners] : corners_) {
    if (corners.empty()) continue;
    Model::Part& part = model->parts.emplace_back(part_of(material));
    part.first_index = static_cast<std::uint32_t>(all.size());
    part.index_count = static_cast<std::uint32_t>(corners.size());
    if (all.empty())
      all.swap(corners);
    else
      all.insert(all.end(), corners.begin(), corners.end());
    corners = {};
  }
  corners_.clear();
  join(all, model.get());
  model->unusable_triangles = std::exchange(unusable_triangles_, 0);
  return model;
}

}  // namespace lumigraft::relight
