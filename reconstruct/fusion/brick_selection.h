#pragma once
// Which bricks a depth image observes.
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/image_lookup.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {

/// One of `count` subsets of the image's blocks, spread evenly over it.
struct ImageSubset {
  int count = 1, index = 0;
};

/// Set of bricks found by earlier searches; a fast filter that may forget. One bit per brick within 64 bricks of the
/// tag along each axis; beyond, a hash table of which each slot holds one brick.
class RecentBricks {
 public:
  RecentBricks() : near_(std::size_t{kEdge} * kEdge * kEdge / 64), far_(std::size_t{1} << 14, kNone) {}
  /// Inserts the brick. False if the set contained it.
  bool insert(const BrickKey& key) {
    const Simd4Int brick = {key[0], key[1], key[2], 0};
    if (has_bit(brick)) {
      const std::uint32_t at = bit_index(brick);
      const std::uint64_t bit = std::uint64_t{1} << at % 64;
      std::uint64_t& bits = near_[at / 64];
      if (bits & bit) return false;
      bits |= bit;
      return true;
    }
    BrickKey& other = far_[BrickKeyHash{}(key) & (far_.size() - 1)];
    // The comparison of std::array is a library call.
    if (other[0] == key[0] && other[1] == key[1] && other[2] == key[2]) return false;
    other = key;
    return true;
  }
  void erase(const BrickKey& key) {
    const Simd4Int brick = {key[0], key[1], key[2], 0};
    if (has_bit(brick)) {
      near_[bit_index(brick) / 64] &= ~(std::uint64_t{1} << bit_index(brick) % 64);
      return;
    }
    BrickKey& slot = far_[BrickKeyHash{}(key) & (far_.size() - 1)];
    if (slot == key) slot = kNone;
  }
  /// Whether a brick near the tag is in the set; false for far ones. Lane 3 of `brick` is 0.
  bool contains(Simd4Int brick) const { return has_bit(brick) && bit_at(bit_index(brick)); }
  /// The same for all bricks of the box from `low` to `high`, which is at most one more along each axis.
  bool contains_all(Simd4Int low, Simd4Int high) const {
    if (!has_bit(low) || !has_bit(high)) return false;
    const std::uint32_t first = bit_index(low), x = static_cast<std::uint32_t>(high[0] - low[0]),
                        y = kEdge * static_cast<std::uint32_t>(high[1] - low[1]),
                        z = kEdge * kEdge * static_cast<std::uint32_t>(high[2] - low[2]);
    const auto row = [&](std::uint32_t at) { return bit_at(at) & bit_at(at + x); };
    return row(first) & row(first + y) & row(first + z) & row(first + y + z);
  }

 private:
  static constexpr int kEdge = 128;
  static constexpr BrickKey kNone = {INT32_MAX, 0, 0};
  static bool has_bit(Simd4Int brick) { return !any((brick + kEdge / 2) & ~(kEdge - 1)); }
  static std::uint32_t bit_index(Simd4Int brick) {
    const Simd4Int at = brick + kEdge / 2;
    return static_cast<std::uint32_t>((at[2] * kEdge + at[1]) * kEdge + at[0]);
  }
  unsigned bit_at(std::uint32_t at) const { return static_cast<unsigned>(near_[at / 64] >> at % 64) & 1u; }

  std::vector<std::uint64_t> near_;
  std::vector<BrickKey> far_;
};

struct DepthRange {
  float from_m = 0, to_m = 0;
};

/// Bricks that intersect the truncation band of a surface observed in this subset of the image, at a depth within
/// `range_m`, sorted, each once. Omits bricks that are in `known`, and inserts the others there.
std::vector<BrickKey> bricks_on_surfaces(const PreparedDepth& view, const DepthPreprocessor& preprocessor,
                                         const Eigen::Isometry3f& T_tag_camera, float voxel_m, float truncation_m,
                                         const ImageSubset& subset, const DepthRange& range_m, RecentBricks& known);

/// Tag frame, metres.
Eigen::Vector3f brick_centre(const BrickKey& key, float voxel_m);

/// Visibility of a brick in a depth image.
struct BrickVisibility {
  enum class Kind {
    hidden,   ///< behind what is observed there, behind the camera, or outside the image
    open,     ///< completely in front, with no surface within the truncation distance
    surface,  ///< neither
  } kind;
  float depth_m = 0;                                       ///< of its centre
  float hidden_m = 0;                                      ///< depth behind which everything is hidden
  int first_u = 0, last_u = -1, first_v = 0, last_v = -1;  ///< pixels that contain it; none if it is at the camera
  bool jumps = false;                                      ///< next to these pixels
  /// Distance of its centre from the surface that is observed there, positive in front of it, relative to the distance
  /// at which that surface leaves the brick.
  float surface_offset = 0;
};
BrickVisibility brick_visibility(const BrickKey& key, const PreparedDepth& view, const PixelMap& map, float focal,
                                 const Eigen::Isometry3f& T_camera_tag, float voxel_m, float truncation_m);

}  // namespace lumigraft::reconstruct
