#include "relight/exhibit/alpha_cutout.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "relight/exhibit/parameters.h"
#include "relight/exhibit/texture_wrap.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;

using Triangle = std::array<Corner, 3>;

Corner between(const Corner& a, const Corner& b, float t, SourceMixes& mixes) {
  const auto mixed = [t](const auto& x, const auto& y) { return (x + t * (y - x)).eval(); };
  Corner c = a;
  c.position_m = mixed(a.position_m, b.position_m);
  c.normal = mixed(a.normal, b.normal).stableNormalized();
  for (std::size_t set = 0; set < 2; ++set) c.texcoords[set] = mixed(a.texcoords[set], b.texcoords[set]);
  c.color = mixed(a.color, b.color);
  c.tangent = mixed(a.tangent, b.tangent).stableNormalized();
  if (a.source != Corner::kNoSource) c.source = mixes.between(a.source, b.source, t);
  return c;
}

class Cutter {
 public:
  /// `max_triangles`: that it may keep.
  Cutter(const AlphaMask& mask, float contour_texels, std::size_t max_triangles, const SourceMixes& mixes)
      : mask_(mask), contour_texels_(contour_texels), max_triangles_(max_triangles), mixes_(mixes) {}

  void add(const Triangle& triangle, int divisions = 0) {
    if (too_many()) return;
    ++parts_;
    const Bounds bounds = bounds_of(triangle);
    if (bounds.none_opaque) return;
    if (bounds.all_opaque) {
      keep(triangle);
    } else if (bounds.longest_texels <= contour_texels_ || divisions == kExhibit.max_divisions) {
      clip(triangle);
    } else {
      const auto& [a, b, c] = triangle;
      const Corner ab = between(a, b, 0.5f, mixes_), bc = between(b, c, 0.5f, mixes_), ca = between(c, a, 0.5f, mixes_);
      for (const Triangle& part : {Triangle{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
        add(part, divisions + 1);
    }
  }
  /// By the alpha at its corners alone (Sutherland & Hodgman 1974).
  void clip(const Triangle& triangle) {
    std::array<Corner, 4> polygon;
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Corner &a = triangle[k], &b = triangle[(k + 1) % 3];
      const float at_a = excess(a), at_b = excess(b);
      if (at_a >= 0) polygon[count++] = a;
      if ((at_a >= 0) != (at_b >= 0)) polygon[count++] = between(a, b, at_a / (at_a - at_b), mixes_);
    }
    for (std::size_t k = 2; k < count; ++k) keep({polygon[0], polygon[k - 1], polygon[k]});
  }

  bool too_many() const {
    return kept_.size() > 3 * max_triangles_ || parts_ > max_triangles_ + kExhibit.max_parts ||
           texels_ > kExhibit.max_texels;
  }
  std::vector<Corner> take(SourceMixes& mixes) {
    mixes = std::move(mixes_);
    return std::move(kept_);
  }

 private:
  struct Bounds {
    bool all_opaque = true, none_opaque = true;
    float longest_texels = 0;  ///< edge
  };

  Vector2f in_texels(const Corner& corner) const {
    const Vector2f& uv = corner.texcoords[mask_.slot.texcoord_set];
    const Vector2f at = mask_.slot.transform * uv.homogeneous();
    return at.cwiseProduct(Vector2f(static_cast<float>(mask_.alpha->width), static_cast<float>(mask_.alpha->height)));
  }

  /// Over the square around the triangle: whether all texels that are interpolated there are alike.
  Bounds bounds_of(const Triangle& triangle) {
    Bounds bounds;
    const std::array<Vector2f, 3> at = {in_texels(triangle[0]), in_texels(triangle[1]), in_texels(triangle[2])};
    for (std::size_t k = 0; k < 3; ++k)
      bounds.longest_texels = std::max(bounds.longest_texels, (at[k] - at[(k + 1) % 3]).norm());
    const Vector2f low = (at[0].cwiseMin(at[1]).cwiseMin(at[2]).array() - 0.5f).floor();
    const Vector2f high = (at[0].cwiseMax(at[1]).cwiseMax(at[2]).array() - 0.5f).floor() + 1;
    const auto columns =
        static_cast<std::int64_t>(std::min(high.x() - low.x() + 1, static_cast<float>(kExhibit.max_square_texels)));
    const auto rows =
        static_cast<std::int64_t>(std::min(high.y() - low.y() + 1, static_cast<float>(kExhibit.max_square_texels)));
    if (columns * rows > kExhibit.max_square_texels) {
      bounds.all_opaque = bounds.none_opaque = false;
      return bounds;
    }
    columns_.clear();
    for (std::int64_t i = 0; i < columns; ++i)
      columns_.push_back(texel(low.x() + static_cast<float>(i), mask_.alpha->width, mask_.slot.wrap_u));
    for (std::int64_t j = 0; j < rows; ++j) {
      texels_ += columns;
      const int v = texel(low.y() + static_cast<float>(j), mask_.alpha->height, mask_.slot.wrap_v);
      for (const int u : columns_) {
        (opaque(mask_.alpha->at(u, v)) ? bounds.none_opaque : bounds.all_opaque) = false;
        if (!bounds.all_opaque && !bounds.none_opaque) return bounds;
      }
    }
    return bounds;
  }

  /// What is shown at a whole number of texels.
  static int texel(float at, int size, Wrap wrap) {
    const float middle = (at + 0.5f) / static_cast<float>(size);
    const TexelNeighbours found = texel_neighbours(middle, size, wrap);
    return found.texel[found.weight > 0.5f ? 1 : 0];
  }

  float of(std::uint8_t value) const { return mask_.factor * static_cast<float>(value) / 255; }
  bool opaque(std::uint8_t value) const { return of(value) >= mask_.cutoff; }

  /// Alpha over the cutoff.
  float excess(const Corner& corner) const {
    const Vector2f at = mask_.slot.transform * corner.texcoords[mask_.slot.texcoord_set].homogeneous();
    const TexelNeighbours u = texel_neighbours(at.x(), mask_.alpha->width, mask_.slot.wrap_u),
                          v = texel_neighbours(at.y(), mask_.alpha->height, mask_.slot.wrap_v);
    const auto value = [&](std::size_t i, std::size_t j) { return of(mask_.alpha->at(u.texel[i], v.texel[j])); };
    const float upper = value(0, 0) + u.weight * (value(1, 0) - value(0, 0)),
                lower = value(0, 1) + u.weight * (value(1, 1) - value(0, 1));
    return upper + v.weight * (lower - upper) - mask_.cutoff;
  }

  void keep(const Triangle& triangle) {
    if (is_usable(triangle[0], triangle[1], triangle[2])) kept_.insert(kept_.end(), triangle.begin(), triangle.end());
  }

  const AlphaMask& mask_;
  float contour_texels_;
  std::size_t max_triangles_;
  SourceMixes mixes_;
  std::vector<Corner> kept_;
  std::size_t parts_ = 0;
  std::int64_t texels_ = 0;
  std::vector<int> columns_;  ///< of the square around a triangle; kept for its memory
};

}  // namespace

std::vector<Corner> cut_out(std::span<const Corner> corners, const AlphaMask& mask, SourceMixes& mixes) {
  if (!mask.alpha)
    return mask.factor >= mask.cutoff ? std::vector(corners.begin(), corners.end()) : std::vector<Corner>();
  const std::size_t max_triangles = corners.size() / 3 + kExhibit.max_more_triangles;
  for (float texels = kExhibit.contour_texels; texels < kExhibit.max_contour_texels; texels *= kExhibit.longer) {
    Cutter cutter(mask, texels, max_triangles, mixes);
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) cutter.add({corners[i], corners[i + 1], corners[i + 2]});
    if (!cutter.too_many()) return cutter.take(mixes);
  }
  Cutter cutter(mask, kExhibit.max_contour_texels, max_triangles, mixes);
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) cutter.clip({corners[i], corners[i + 1], corners[i + 2]});
  return cutter.take(mixes);
}

}  // namespace lumigraft::relight
