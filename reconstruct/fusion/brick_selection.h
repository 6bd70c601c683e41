#pragma once
// Which bricks a depth picture tells about.
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/projection.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {

/// Nothing is fused closer to the camera.
constexpr float kNearestM = 0.05f;
/// How far along rays everything is behind what is open, in truncation distances: it is that distance itself away from
/// planes inclined by 75°.
constexpr float kOpenReach = 4;

/// One in `of` parts of the picture, spread over it evenly.
struct PictureShare {
  int of = 1, which = 0;
};

/// Bricks met before, to know most of them again at once: a bit for each within some metres of the tag, beyond them one
/// brick for each place of a table.
class RecentBricks {
 public:
  RecentBricks() : near_(std::size_t{kEdge} * kEdge * kEdge / 64), far_(std::size_t{1} << 14, {INT32_MAX, 0, 0}) {}
  /// Whether it is not among them; it is from then on.
  bool meet(const BrickKey& key) {
    const Simd4Int brick = {key[0], key[1], key[2], 0};
    if (near(brick)) {
      const std::uint32_t at = place(brick);
      const std::uint64_t bit = std::uint64_t{1} << at % 64;
      std::uint64_t& bits = near_[at / 64];
      if (bits & bit) return false;
      bits |= bit;
      return true;
    }
    BrickKey& other = far_[BrickKeyHash{}(key) & (far_.size() - 1)];
    // std::array's own comparison is a call.
    if (other[0] == key[0] && other[1] == key[1] && other[2] == key[2]) return false;
    other = key;
    return true;
  }
  /// Whether it is surely among them; the fourth of `brick` is 0.
  bool has(Simd4Int brick) const { return near(brick) && bit_at(place(brick)); }
  /// The same of all eight of which each coordinate is one of these two; `high` is at most one more than `low`.
  bool has_all(Simd4Int low, Simd4Int high) const {
    if (!near(low) || !near(high)) return false;
    const std::uint32_t first = place(low), x = static_cast<std::uint32_t>(high[0] - low[0]),
                        y = kEdge * static_cast<std::uint32_t>(high[1] - low[1]),
                        z = kEdge * kEdge * static_cast<std::uint32_t>(high[2] - low[2]);
    const auto row = [&](std::uint32_t at) { return bit_at(at) & bit_at(at + x); };
    return row(first) & row(first + y) & row(first + z) & row(first + y + z);
  }

 private:
  static constexpr int kEdge = 128;
  static bool near(Simd4Int brick) { return !any((brick + kEdge / 2) & ~(kEdge - 1)); }
  static std::uint32_t place(Simd4Int brick) {
    const Simd4Int at = brick + kEdge / 2;
    return static_cast<std::uint32_t>((at[2] * kEdge + at[1]) * kEdge + at[0]);
  }
  unsigned bit_at(std::uint32_t at) const { return static_cast<unsigned>(near_[at / 64] >> at % 64) & 1u; }

  std::vector<std::uint64_t> near_;
  std::vector<BrickKey> far_;
};

/// Bricks that the truncation band of any surface seen in this share touches, in order, each once, but for most of
/// those that were `met`.
std::vector<BrickKey> bricks_on_surfaces(const PreparedDepth& view, const DepthPreparation& preparation,
                                         const Eigen::Isometry3f& T_tag_camera, float voxel_m, float truncation_m,
                                         const PictureShare& share, RecentBricks& met);

Eigen::Vector3f middle_of(const BrickKey& key, float voxel_m);

/// How a brick stands to what the camera sees.
struct Sight {
  enum class Kind {
    hidden,   ///< behind everything seen there, behind the camera, or out of the picture
    open,     ///< wholly in front, with nothing within the truncation distance
    surface,  ///< neither
  } kind;
  float far_m = 0;              ///< depth behind which everything is hidden
  Eigen::Vector2f pixel{0, 0};  ///< of its middle
  float reach = 0;              ///< pixels, from there to all of it
};
Sight sight_of(const BrickKey& key, const PreparedDepth& view, const PixelMap& map, float focal,
               const Eigen::Isometry3f& T_camera_tag, float voxel_m, float truncation_m);

}  // namespace lumigraft::reconstruct
