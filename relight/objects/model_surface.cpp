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

struct Triangle {
  std::array<Vector3f, 3> position_m, normal;
  std::array<Vector2f, 3> texcoord;

  Triangle(const Model& model, std::uint32_t number) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = model.indices[3 * std::size_t{number} + k];
      position_m[k] = model.positions_m[vertex];
      normal[k] = model.normals[vertex];
      texcoord[k] = model.texcoords[vertex];
    }
  }

  Vector3f edge(std::size_t k) const { return position_m[k] - position_m[0]; }
  Vector3f turn(std::size_t k) const { return normal[k] - normal[0]; }
  Vector2f span(std::size_t k) const { return texcoord[k] - texcoord[0]; }
  float texcoord_area2() const { return span(1).x() * span(2).y() - span(1).y() * span(2).x(); }  ///< twice, with sign

  /// Texture coordinates per metre, in the mean of all directions.
  float texcoord_density() const {
    return std::sqrt(std::abs(texcoord_area2()) / std::max(edge(1).cross(edge(2)).norm(), 1e-30f));
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
  std::optional<std::array<Vector3f, 2>> tangents(const Vector3f& up) const {
    const float area = texcoord_area2();
    if (!(std::abs(area) > 0)) return std::nullopt;
    const Vector3f along_u = (edge(1) * span(2).y() - edge(2) * span(1).y()) / area;
    const Vector3f along_v = (edge(2) * span(1).x() - edge(1) * span(2).x()) / area;
    const Vector3f x = along_u - up.dot(along_u) * up;
    const float length = x.stableNorm();
    if (!(length > 0 && std::isfinite(length))) return std::nullopt;
    const Vector3f y = up.cross(Vector3f(x / length));
    return std::array<Vector3f, 2>{x / length, y.dot(along_v) > 0 ? Vector3f(-y) : y};
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

}  // namespace

float alpha_with(float alpha, float normal_variance) {
  return std::min(std::sqrt(alpha * alpha + 2 * normal_variance), 1.0f);
}

ModelSurface::ModelSurface(const Model& model, bool mips) : model_(model) {
  if (model.parts.size() > 1) part_of_triangle_.assign(model.indices.size() / 3, 0);
  std::map<std::pair<TexturePicture, Texels>, std::shared_ptr<const Texture>> made;  // parts may share pictures
  const auto texture = [&](const TexturePicture& picture, Texels texels) {
    auto& found = made[{picture, texels}];
    if (!found) found = std::make_shared<Texture>(picture, texels, mips);
    return found;
  };
  for (std::uint32_t p = 0; p < model.parts.size(); ++p) {
    const Model::Part& part = model.parts[p];
    Textures& textures = textures_.emplace_back();
    for (const auto& [picture, texels] : textures_of(part)) {
      auto& to = texels == Texels::srgb     ? textures.base_color
                 : texels == Texels::linear ? textures.metallic_roughness
                                            : textures.normals;
      to = texture(picture, texels);
    }
    if (part_of_triangle_.empty()) continue;
    std::fill_n(part_of_triangle_.begin() + part.first_index / 3, part.index_count / 3, p);
  }
}

ModelSurface::Shading ModelSurface::at(const ModelPoint& point, const MaterialOverride& material) const {
  const Model::Part& part = model_.parts[this->part(point.triangle)];
  const Vector3f interpolated = mixed(model_, model_.normals, point).stableNormalized();
  Shading s{material.over(part.material), interpolated, interpolated};
  if (!material.base_color) s.material.base_color.array() *= mixed(model_, model_.colors, point).array();
  const Triangle triangle(model_, point.triangle);
  const Textures& textures = textures_[this->part(point.triangle)];
  if (textures.empty()) return s;
  const Vector2f uv = mixed(model_, model_.texcoords, point);
  const auto value = [&](const std::shared_ptr<const Texture>& from) {
    return from->at(uv, point.footprint_m * triangle.texcoord_density() * std::sqrt(from->texels()));
  };
  if (textures.base_color && !material.base_color) s.material.base_color.array() *= value(textures.base_color).array();
  if (textures.metallic_roughness && !(material.metallic && material.roughness)) {
    const Vector3f both = value(textures.metallic_roughness);
    if (!material.roughness) s.material.roughness = part.roughness_factor * both.y();
    if (!material.metallic) s.material.metallic = part.metallic_factor * both.z();
  }
  const auto tangents = textures.normals ? triangle.tangents(s.normal) : std::nullopt;
  if (!tangents) return s;
  Vector3f map = value(textures.normals);
  const float variance = part.normal_scale * part.normal_scale * std::max(1 - map.norm(), 0.0f);
  map.head<2>() *= part.normal_scale;
  const Vector3f turned = map.x() * (*tangents)[0] + map.y() * (*tangents)[1] + map.z() * s.normal;
  if (turned.stableNorm() > 0) s.normal = turned.stableNormalized();
  s.material.roughness = std::sqrt(alpha_with(s.material.roughness * s.material.roughness, variance));
  return s;
}

float ModelSurface::normal_variance(std::uint32_t triangle) const {
  return Triangle(model_, triangle).normal_variance();
}

}  // namespace lumigraft::relight
