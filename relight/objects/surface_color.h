#pragma once
// Base colour of a point on a model's surface.
#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// Of an sRGB texture, linear: bilinear between texel centres, which are at (x + 1/2) / width; repeats.
Eigen::Vector3f texel(const capture::Image<std::uint8_t>& texture, const Eigen::Vector2f& uv);

/// Texture × vertex colour × the part's base colour, linear. Textures repeat, and are read at the mip level whose texel
/// size is about that of the footprint.
class ObjectColor {
 public:
  explicit ObjectColor(const Model& model);                                                 ///< keeps a reference
  std::uint32_t part(std::uint32_t triangle) const { return part_of_triangle_[triangle]; }  ///< index into Model::parts
  Eigen::Vector3f at(std::uint32_t triangle, const Eigen::Vector3f& barycentric, float footprint_m) const;

 private:
  using Picture = capture::Image<std::uint8_t>;
  using Pyramid = std::vector<capture::Image<float>>;  ///< linear; the first level has half the texture's size
  Eigen::Vector3f texture_at(const Picture& texture, std::uint32_t triangle, const Eigen::Vector3f& barycentric,
                             float footprint_m) const;

  const Model& model_;
  std::vector<std::uint32_t> part_of_triangle_;
  std::map<const Picture*, Pyramid> pyramids_;  ///< look-up only, never iterated
};

}  // namespace lumigraft::relight
