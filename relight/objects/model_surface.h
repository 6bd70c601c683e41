#pragma once
// Material and shading normal of a point on a model's surface, by its textures.
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "relight/objects/texture.h"

namespace lumigraft::relight {

/// A parallelogram in the plane of a triangle, in metres of the model.
struct SurfaceCell {
  Eigen::Vector3f to_centre_m;         ///< from a point
  Eigen::Matrix<float, 3, 2> edges_m;  ///< columns
};

/// A point of a triangle, and where the mean of textures is wanted: in `cell` or, without one, in a square around the
/// point with this edge, metres of the model.
struct ModelPoint {
  std::uint32_t triangle = 0;
  Eigen::Vector3f barycentric = Eigen::Vector3f::Zero();
  float footprint_m = 0;
  std::optional<SurfaceCell> cell = {};
};

/// GGX alpha of a surface with normals of this variance along each axis: α² is increased by twice as much, as the
/// slopes of a Gaussian surface have in Beckmann's distribution (Tokuyoshi & Kaplanyan 2019, "Improved Geometric
/// Specular Antialiasing").
float alpha_with(float alpha, float normal_variance);

class ModelSurface {
 public:
  /// Keeps a reference. Without mip levels every footprint is taken for a point.
  ModelSurface(const Model& model, bool mips);
  /// Of another pose of the same model, whose textures are shared.
  ModelSurface(const Model& posed, const ModelSurface& at_rest);

  /// Index into Model::parts.
  std::uint32_t part(std::uint32_t triangle) const {
    return part_of_triangle_.empty() ? 0 : part_of_triangle_[triangle];
  }

  struct Shading {
    Material material;
    Eigen::Vector3f interpolated;  ///< normal, unit, model frame
    Eigen::Vector3f normal;        ///< the same, turned by the normal map
    Eigen::Vector3f coat_normal;   ///< likewise, by that of the coat
    /// Of an anisotropic material, the direction in which it is rougher, unit, along the interpolated surface; else
    /// zero.
    Eigen::Vector3f rough_along;
    float opacity = 1;  ///< Model::Part::blends
  };
  /// Base colour: texture × vertex colour × the part's, linear; emission: texture × the part's. Where normals of the
  /// map differ within the footprint the roughness is increased by their variance along each axis, which is about 1 -
  /// l, l being the length of the mean of its unit vectors (Toksvig 2005, "Mipmapping Normal Maps").
  Shading at(const ModelPoint& point, const MaterialOverride& material) const;

  /// Of the point itself (Shading::opacity); `u`, `v`: barycentric weights of the second and third vertex.
  float opacity(std::uint32_t triangle, float u, float v) const;

  bool textured(std::uint32_t triangle) const { return textured_[part(triangle)]; }

  /// Variance of the interpolated normals along each axis, in a square with edges of a metre of the model; of another
  /// square in proportion to its area.
  float normal_variance(std::uint32_t triangle) const;

 private:
  class TexturedPoint;
  /// A normal map at a point: its mean over the point's square, the slot that it is of, and its scale.
  struct NormalMap {
    Eigen::Vector3f mean;
    const Model::TextureSlot& slot;
    float scale;
  };
  /// Turns a normal by the map; returns the variance of the map's normals along each axis.
  float turn_normal(const ModelPoint& point, const NormalMap& map, const Eigen::Vector3f& interpolated,
                    Eigen::Vector3f* normal) const;
  void read_layers(const MaterialOverride& material, TexturedPoint& textured, Shading* s) const;
  void read_anisotropy(const ModelPoint& point, TexturedPoint& textured, Shading* s) const;

  struct PlacedTexture {
    std::shared_ptr<const Texture> texture;  ///< null: none
    float texels_per_texcoord = 0;           ///< square root of the texels in a unit square of the part's coordinates
  };

  const Model& model_;
  std::vector<std::uint32_t> part_of_triangle_;         ///< empty if the model has only one
  std::vector<PerTextureUse<PlacedTexture>> textures_;  ///< per part
  std::vector<bool> textured_;                          ///< per part: any
};

}  // namespace lumigraft::relight
