#pragma once
// The triangles of a model that emit light, to sample points on them. In the model's frame: constant for a rigid
// object.
#include <cstdint>
#include <memory>
#include <vector>

#include "relight/objects/model_surface.h"

namespace lumigraft::relight {

class EmissiveSurface {
 public:
  /// Null if nothing emits. Keeps a reference to the model.
  static std::shared_ptr<const EmissiveSurface> of(const Model& model, const MaterialOverride& material);

  struct Point {
    std::uint32_t triangle = 0;
    Eigen::Vector3f barycentric = Eigen::Vector3f::Zero();
    Eigen::Vector3f position_m, normal;                ///< geometric, on the side that emits
    Eigen::Array3f emission = Eigen::Array3f::Zero();  ///< as in Material, times the opacity
    float pdf = 0;                                     ///< 1/m² of the model
    float clearcoat = 0;                               ///< as in Material: it takes its share of the emission
  };
  /// Stratified if `u` is.
  Point sample(const Eigen::Vector2f& u) const;
  float pdf(std::uint32_t triangle) const { return pdf_[triangle]; }

  /// So many parts of equal power, in an order in which neighbours are near each other.
  static constexpr std::size_t kPatches = 256;
  struct Patch {
    Eigen::Vector3f position_m = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();  ///< means; normal <= 1
    Eigen::Array3f emission = Eigen::Array3f::Zero();  ///< under a coat, the mean of all directions
    float pdf = 0;                                     ///< as in Point
  };
  const std::vector<Patch>& patches() const { return patches_; }

  float power() const { return power_; }  ///< luminance of emission times area, m²

 private:
  EmissiveSurface(const Model& model, const MaterialOverride& material);
  /// Luminance of emission times opacity over a triangle, over that of the factor alone.
  float mean_of_texture(std::uint32_t triangle) const;

  const Model& model_;
  MaterialOverride material_;
  ModelSurface surface_;
  std::vector<std::uint32_t> triangles_;  ///< that emit, in an order of places
  std::vector<Patch> patches_;
  std::vector<float> cumulative_power_;  ///< of each of them and those before, as a fraction
  std::vector<float> pdf_;               ///< of every triangle of the model
  float power_ = 0;
};

}  // namespace lumigraft::relight
