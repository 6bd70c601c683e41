#include "relight/objects/model_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kMinTangent2 = 1e-6f;  // of interpolated unit vectors; shorter ones have no direction

using Tangents = std::array<Vector3f, 2>;

using TriangleTexcoords = std::array<Vector2f, 3>;

const std::vector<Vector2f>& texcoords_of(const Model& model, unsigned set) {
  return set == 0 ? model.texcoords : model.texcoords_1;
}

TriangleTexcoords texcoords_of(const Model& model, std::uint32_t triangle, unsigned set) {
  const std::uint32_t* v = &model.indices[3 * std::size_t{triangle}];
  const std::vector<Vector2f>& all = texcoords_of(model, set);
  return {all[v[0]], all[v[1]], all[v[2]]};
}

Vector2f span(const TriangleTexcoords& texcoords, std::size_t k) { return texcoords[k] - texcoords[0]; }

/// Twice the area, with sign.
float area2(const TriangleTexcoords& texcoords) {
  const Vector2f a = span(texcoords, 1), b = span(texcoords, 2);
  return a.x() * b.y() - a.y() * b.x();
}

struct Triangle {
  std::array<Vector3f, 3> position_m, normal;

  Triangle(const Model& model, std::uint32_t number) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = model.indices[3 * std::size_t{number} + k];
      position_m[k] = model.positions_m[vertex];
      normal[k] = model.normals[vertex];
    }
  }

  Vector3f edge(std::size_t k) const { return position_m[k] - position_m[0]; }
  Vector3f turn(std::size_t k) const { return normal[k] - normal[0]; }

  /// Texture coordinates per metre, in the mean of all directions.
  float texcoord_density(const TriangleTexcoords& texcoords) const {
    return std::sqrt(std::abs(area2(texcoords)) / std::max(edge(1).cross(edge(2)).norm(), 1e-30f));
  }

  /// Change of texture coordinates along vectors in the triangle's plane, 1/m; zero if the triangle has no area.
  Eigen::Matrix<float, 2, 3> texcoords_per_metre(const TriangleTexcoords& texcoords) const {
    const Vector3f first = edge(1), second = edge(2), across = first.cross(second);
    const float area2 = across.squaredNorm();
    if (!(area2 > 0)) return Eigen::Matrix<float, 2, 3>::Zero();
    // Rows of the edges' inverse.
    return (span(texcoords, 1) * second.cross(across).transpose() +
            span(texcoords, 2) * across.cross(first).transpose()) /
           area2;
  }

  /// Variance of the interpolated normals along each axis, in a square with edges of a metre: of a quantity with this
  /// gradient it is a twelfth of the gradient's square.
  float normal_variance() const {
    const float a = edge(1).squaredNorm(), b = edge(1).dot(edge(2)), c = edge(2).squaredNorm();
    const float determinant = a * c - b * b;
    if (!(determinant > 0)) return 0;
    const float gradient2 =
        (c * turn(1).squaredNorm() - 2 * b * turn(1).dot(turn(2)) + a * turn(2).squaredNorm()) / determinant;
    return std::max(gradient2, 0.0f) / (2 * 12);
  }

  /// Directions of x and y of a normal map, perpendicular to a unit normal; nothing if the texture has no area there.
  std::optional<Tangents> tangents(const TriangleTexcoords& texcoords, const Vector3f& up) const {
    const float area = area2(texcoords);
    if (!(std::abs(area) > 0)) return std::nullopt;
    const Vector2f first = span(texcoords, 1), second = span(texcoords, 2);
    const Vector3f along_u = (edge(1) * second.y() - edge(2) * first.y()) / area;
    const Vector3f along_v = (edge(2) * first.x() - edge(1) * second.x()) / area;
    const Vector3f x = along_u - up.dot(along_u) * up;
    const float length = x.stableNorm();
    if (!(length > 0 && std::isfinite(length))) return std::nullopt;
    const Vector3f y = up.cross(Vector3f(x / length));
    return Tangents{x / length, y.dot(along_v) > 0 ? Vector3f(-y) : y};
  }
};

template <typename Value>
Value mixed(const Model& model, const std::vector<Value>& values, const ModelPoint& point) {
  Value sum = Value::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    sum += point.barycentric[static_cast<Eigen::Index>(k)] * values[model.indices[3 * std::size_t{point.triangle} + k]];
  }
  return sum;
}

/// Of the vertices' tangents; nothing where they have none.
std::optional<Tangents> vertex_tangents(const Model& model, const ModelPoint& point, const Vector3f& up) {
  if (model.tangents.empty()) return std::nullopt;
  const Eigen::Vector4f tangent = mixed(model, model.tangents, point);
  const Vector3f along = tangent.head<3>(), x = along - up.dot(along) * up;
  if (!(x.squaredNorm() > kMinTangent2)) return std::nullopt;
  const Vector3f unit = x.normalized();
  return Tangents{unit, std::copysign(1.0f, tangent.w()) * up.cross(unit)};
}

/// By the texture, whose coordinates are transformed.
std::optional<Tangents> triangle_tangents(const Model& model, std::uint32_t triangle, const Model::TextureSlot& slot,
                                          const Vector3f& up) {
  TriangleTexcoords texcoords = texcoords_of(model, triangle, slot.texcoord_set);
  for (Vector2f& texcoord : texcoords) texcoord = slot.transform * texcoord.homogeneous();
  return Triangle(model, triangle).tangents(texcoords, up);
}

}  // namespace

float alpha_with(float alpha, float normal_variance) {
  return std::min(std::sqrt(alpha * alpha + 2 * normal_variance), 1.0f);
}

ModelSurface::ModelSurface(const Model& model, bool mips) : model_(model) {
  if (model.parts.size() > 1) part_of_triangle_.assign(model.indices.size() / 3, 0);
  std::map<std::pair<TexturePicture, Texels>, std::shared_ptr<const Texture>> made;  // parts may share pictures
  for (std::uint32_t p = 0; p < model.parts.size(); ++p) {
    const Model::Part& part = model.parts[p];
    PerTextureUse<PlacedTexture>& textures = textures_.emplace_back();
    textured_.push_back(false);
    for (const TextureUse use : kTextureUses) {
      const Model::TextureSlot& slot = slot_of(part, use);
      if (!has_picture(slot)) continue;
      std::shared_ptr<const Texture>& texture = made[{slot.picture, texels_of(use)}];
      if (!texture) texture = std::make_shared<Texture>(slot.picture, texels_of(use), mips);
      const float area = std::abs(slot.transform.leftCols<2>().determinant()) * texture->texels();
      textures[static_cast<std::size_t>(use)] = {texture, std::sqrt(area)};
      textured_.back() = true;
    }
    if (part_of_triangle_.empty()) continue;
    std::fill_n(part_of_triangle_.begin() + part.first_index / 3, part.index_count / 3, p);
  }
}

ModelSurface::ModelSurface(const Model& posed, const ModelSurface& at_rest)
    : model_(posed),
      part_of_triangle_(at_rest.part_of_triangle_),
      textures_(at_rest.textures_),
      textured_(at_rest.textured_) {}

/// A point as the textures of its part see it.
class ModelSurface::TexturedPoint {
 public:
  TexturedPoint(const ModelSurface& surface, const ModelPoint& point)
      : model_(surface.model_),
        point_(point),
        part_(surface.part(point.triangle)),
        textures_(surface.textures_[part_]) {}

  const Model::Part& part() const { return model_.parts[part_]; }

  /// The mean over the point's cell or square; nothing if the part has no such texture.
  std::optional<Vector3f> texel(TextureUse use) {
    const PlacedTexture& placed = textures_[static_cast<std::size_t>(use)];
    if (!placed.texture) return std::nullopt;
    const Model::TextureSlot& slot = slot_of(part(), use);
    const Coordinates& at = coordinates(slot.texcoord_set);
    const Vector2f uv = slot.transform.leftCols<2>() * at.texcoord + slot.transform.col(2);
    if (point_.cell) {
      const Eigen::Matrix<float, 2, 3> per_metre = slot.transform.leftCols<2>() * at.per_metre;
      return placed.texture->mean(uv + per_metre * point_.cell->to_centre_m, per_metre * point_.cell->edges_m,
                                  slot.wrap_u, slot.wrap_v);
    }
    return placed.texture->at(uv, point_.footprint_m * at.density * placed.texels_per_texcoord, slot.wrap_u,
                              slot.wrap_v);
  }

 private:
  struct Coordinates {
    bool known = false;
    Vector2f texcoord;
    float density = 0;
    Eigen::Matrix<float, 2, 3> per_metre;  ///< of vectors in the triangle's plane; with a cell
  };

  const Coordinates& coordinates(unsigned set) {
    Coordinates& at = coordinates_[set];
    if (at.known) return at;
    const TriangleTexcoords corners = texcoords_of(model_, point_.triangle, set);
    at.texcoord.setZero();
    for (std::size_t k = 0; k < 3; ++k) at.texcoord += point_.barycentric[static_cast<Eigen::Index>(k)] * corners[k];
    if (point_.cell)
      at.per_metre = Triangle(model_, point_.triangle).texcoords_per_metre(corners);
    else if (point_.footprint_m > 0)
      at.density = Triangle(model_, point_.triangle).texcoord_density(corners);
    at.known = true;
    return at;
  }

  const Model& model_;
  const ModelPoint& point_;
  std::uint32_t part_;
  const PerTextureUse<PlacedTexture>& textures_;
  std::array<Coordinates, 2> coordinates_;  // by set
};

ModelSurface::Shading ModelSurface::at(const ModelPoint& point, const MaterialOverride& material) const {
  TexturedPoint textured(*this, point);
  const Model::Part& part = textured.part();
  const Vector3f interpolated = mixed(model_, model_.normals, point).stableNormalized();
  Shading s{material.over(part.material), interpolated, interpolated, interpolated, Vector3f::Zero(), 1};
  if (!material.base_color) {
    s.material.base_color.array() *= mixed(model_, model_.colors, point).array();
    if (const auto color = textured.texel(TextureUse::base_color)) s.material.base_color.array() *= color->array();
  }
  if (!material.emission) {
    if (const auto emission = textured.texel(TextureUse::emission)) s.material.emission.array() *= emission->array();
  }
  if (!(material.metallic && material.roughness)) {
    if (const auto both = textured.texel(TextureUse::metallic_roughness)) {
      if (!material.roughness) s.material.roughness = part.roughness_factor * both->y();
      if (!material.metallic) s.material.metallic = part.metallic_factor * both->z();
    }
  }
  if (!material.transmission) {
    if (const auto passing = textured.texel(TextureUse::transmission))
      s.material.transmission = part.transmission_factor * passing->x();
  }
  if (part.blends()) {
    s.opacity = part.opacity_factor;
    if (const auto alpha = textured.texel(TextureUse::opacity)) s.opacity *= alpha->x();
  }
  read_layers(material, textured, &s);
  if (const auto map = textured.texel(TextureUse::normals)) {
    const float variance = turn_normal(point, {*map, part.normal_texture, part.normal_scale}, interpolated, &s.normal);
    s.material.roughness = std::sqrt(alpha_with(s.material.roughness * s.material.roughness, variance));
  }
  if (s.material.anisotropy > 0) read_anisotropy(point, textured, &s);
  if (!(s.material.clearcoat > 0)) return s;
  if (const auto map = textured.texel(TextureUse::clearcoat_normals)) {
    const float variance = turn_normal(point, {*map, part.clearcoat_normal_texture, part.clearcoat_normal_scale},
                                       interpolated, &s.coat_normal),
                alpha = s.material.clearcoat_roughness * s.material.clearcoat_roughness;
    s.material.clearcoat_roughness = std::sqrt(alpha_with(alpha, variance));
  }
  return s;
}

float ModelSurface::opacity(std::uint32_t triangle, float u, float v) const {
  const Model::Part& part = model_.parts[this->part(triangle)];
  if (!part.opacity_texture.picture) return part.opacity_factor;
  const ModelPoint point{triangle, {1 - u - v, u, v}};
  const auto alpha = TexturedPoint(*this, point).texel(TextureUse::opacity);
  return alpha ? part.opacity_factor * alpha->x() : part.opacity_factor;
}

void ModelSurface::read_layers(const MaterialOverride& material, TexturedPoint& textured, Shading* surface) const {
  const Model::Part& part = textured.part();
  Shading& s = *surface;
  if (!material.clearcoat) {
    if (const auto coat = textured.texel(TextureUse::clearcoat))
      s.material.clearcoat = part.clearcoat_factor * coat->x();
  }
  if (!material.clearcoat_roughness) {
    if (const auto coat = textured.texel(TextureUse::clearcoat_roughness))
      s.material.clearcoat_roughness = part.clearcoat_roughness_factor * coat->y();
  }
  if (!material.specular) {
    if (const auto factor = textured.texel(TextureUse::specular))
      s.material.specular = part.specular_factor * factor->x();
    if (const auto color = textured.texel(TextureUse::specular_color))
      s.material.specular_color = part.specular_color_factor.cwiseProduct(*color);
  }
  if (material.base_color || !(part.sheen_color_factor.maxCoeff() > 0)) return;
  if (const auto color = textured.texel(TextureUse::sheen_color))
    s.material.sheen_color = part.sheen_color_factor.cwiseProduct(*color);
  if (const auto roughness = textured.texel(TextureUse::sheen_roughness))
    s.material.sheen_roughness = part.sheen_roughness_factor * roughness->x();
}

/// The direction is in the frame of the normal map or, without one, of this texture or the first texture coordinates.
void ModelSurface::read_anisotropy(const ModelPoint& point, TexturedPoint& textured, Shading* s) const {
  const Model::Part& part = textured.part();
  Vector2f direction = Vector2f::UnitX();
  if (const auto texel = textured.texel(TextureUse::anisotropy)) {
    const Vector2f read = 2 * texel->head<2>() - Vector2f::Ones();
    if (read.norm() > 0) direction = read.normalized();
    s->material.anisotropy = part.anisotropy_factor * texel->z();
  }
  const Vector2f rotated = Eigen::Rotation2Df(s->material.anisotropy_rotation_rad) * direction;
  auto tangents = vertex_tangents(model_, point, s->interpolated);
  const Model::TextureSlot& frame = has_picture(part.normal_texture) ? part.normal_texture : part.anisotropy_texture;
  if (!tangents) tangents = triangle_tangents(model_, point.triangle, frame, s->interpolated);
  if (tangents)
    s->rough_along = rotated.x() * (*tangents)[0] + rotated.y() * (*tangents)[1];
  else
    s->material.anisotropy = 0;
}

float ModelSurface::turn_normal(const ModelPoint& point, const NormalMap& map, const Vector3f& interpolated,
                                Vector3f* normal) const {
  auto tangents = vertex_tangents(model_, point, interpolated);
  if (!tangents) tangents = triangle_tangents(model_, point.triangle, map.slot, interpolated);
  if (!tangents) return 0;
  const Vector3f turned =
      map.scale * (map.mean.x() * (*tangents)[0] + map.mean.y() * (*tangents)[1]) + map.mean.z() * interpolated;
  if (turned.stableNorm() > 0) *normal = turned.stableNormalized();
  return map.scale * map.scale * std::max(1 - map.mean.norm(), 0.0f);
}

float ModelSurface::normal_variance(std::uint32_t triangle) const {
  return Triangle(model_, triangle).normal_variance();
}

}  // namespace lumigraft::relight
