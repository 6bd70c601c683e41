#pragma once
// The room as a truncated signed distance field in the tag frame (Curless & Levoy 1996), sparse: bricks of 8³
// voxels exist only near surfaces. A published field is immutable; copies share its bricks (brick_map.h).
//
// Voxel (i, j, k) of the infinite grid has its centre at voxel_m · (i, j, k) metres in the tag frame. Brick (a, b, c)
// holds voxels 8a..8a+7, 8b..8b+7, 8c..8c+7; inside a brick the index is x + 8 (y + 8 z).
// distance_m is positive in front of surfaces (in free space), negative behind, clamped to ± truncation_m.
// A voxel with weight 0 was never observed: it is unknown, neither free nor solid.
// Surface far from the cameras is in `coarse`, in larger voxels; each function uses it where the field itself is
// unknown.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/field/brick_map.h"
#include "reconstruct/field/seen_space.h"

namespace lumigraft::reconstruct {

constexpr int kBrickEdge = 8;
constexpr int kBrickVoxels = kBrickEdge * kBrickEdge * kBrickEdge;

/// Colour of a brick's voxels near surfaces.
struct alignas(64) BrickColor {
  /// Mean radiance towards the cameras, W/sr/m²; where it clipped in all frames a lower bound.
  std::array<Eigen::Vector3f, kBrickVoxels> radiance;
  /// Of the mean. 0: no colour was observed. Below: `radiance` is a lower bound in the channels that clipped, of which
  /// this is minus the sum: 1 red, 2 green, 4 blue.
  std::array<float, kBrickVoxels> weight;
  BrickColor() {
    radiance.fill(Eigen::Vector3f::Zero());
    weight.fill(0);
  }
};

struct alignas(64) FieldBrick {  // so that a row of eight voxels is in one cache line
  std::array<float, kBrickVoxels> distance_m{};
  std::array<float, kBrickVoxels> weight{};  ///< sum of measurement weights, capped; 0 = unknown
  /// Null: no colour was observed, as in a quarter of a kitchen's bricks. Two thirds of a brick's memory; copies of a
  /// brick share it.
  std::shared_ptr<const BrickColor> color;

  Eigen::Vector3f radiance(std::size_t voxel) const {
    return color ? color->radiance[voxel] : Eigen::Vector3f(Eigen::Vector3f::Zero());
  }
  float radiance_weight(std::size_t voxel) const { return color ? std::max(color->weight[voxel], 0.0f) : 0; }
  /// The channels in which radiance() is a lower bound, one bit each, 1 is red; all where none of it was observed.
  int clipped_channels(std::size_t voxel) const {
    const float sum = color ? -color->weight[voxel] : 0;
    return sum < 0 ? 0 : sum > 0 ? static_cast<int>(sum) : kAllChannels;
  }
  static constexpr int kAllChannels = 7;
  /// Replaces the colour by a copy that no other brick shares, to be written.
  BrickColor& own_color() {
    auto own = color ? std::make_shared<BrickColor>(*color) : std::make_shared<BrickColor>();
    color = own;
    return *own;
  }
};

/// Of a voxel of the infinite grid: its brick, and its index in the brick. Shifts round down, negative indices too.
inline BrickKey brick_of(const Eigen::Vector3i& voxel) { return {voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3}; }
inline int index_in_brick(const Eigen::Vector3i& voxel) {
  return (voxel.x() & 7) + kBrickEdge * ((voxel.y() & 7) + kBrickEdge * (voxel.z() & 7));
}
inline Eigen::Vector3i first_voxel(const BrickKey& key) {
  return kBrickEdge * Eigen::Map<const Eigen::Vector3i>(key.data());
}
/// The voxel with this index in the brick.
inline Eigen::Vector3i voxel_in(const BrickKey& key, int index) {
  return first_voxel(key) + Eigen::Vector3i(index & 7, index >> 3 & 7, index >> 6);
}

struct FieldSample {
  float distance_m = 0;
  float weight = 0;
};

struct FieldSlope {
  float distance_m = 0;
  Eigen::Vector3f gradient;  ///< metres of distance per metre, towards free space; length about 1 near surfaces
};

struct RayHit {
  Eigen::Vector3f position_m;  ///< tag frame
  Eigen::Vector3f normal;      ///< unit, tag frame, towards free space
  float distance_m = 0;        ///< along the ray
};

struct DistanceField {
  float voxel_m = 0.008f;
  float truncation_m = 0.032f;
  std::uint64_t version = 0;            ///< increases with every publication that changed something
  std::uint64_t occluders_version = 0;  ///< changes with surface merged into it or taken out of it (OccluderMerge,
                                        ///< MaskedField); 0 = none
  std::vector<Eigen::Vector3f>
      seen_from_m;  ///< camera positions at some distance from each other, at most 64; tag frame
  std::vector<std::shared_ptr<const SeenSpace>> seen_space;  ///< of the newest images from there
  BrickMap<FieldBrick> bricks;
  std::shared_ptr<const DistanceField> coarse;  ///< without a coarser one of its own; null = none

  const FieldBrick* brick(const BrickKey& key) const;
  /// Trilinear interpolation; empty unless all 8 voxels around the point are known.
  std::optional<FieldSample> sample(const Eigen::Vector3f& position_m) const;
  /// Normalised central differences of `sample`, towards free space; empty where unknown.
  std::optional<Eigen::Vector3f> normal(const Eigen::Vector3f& position_m) const;
  /// Value and analytic gradient of the trilinear interpolant; empty where `sample` is. Cheaper than `normal`.
  std::optional<FieldSlope> slope(const Eigen::Vector3f& position_m) const;
  /// Radiance interpolated over those of the 8 voxels around the point that have colour; empty if none has.
  std::optional<Eigen::Vector3f> radiance(const Eigen::Vector3f& position_m) const;
  /// Whether there is a brick at the point: surfaces of `coarse` do not count there.
  bool has_brick_at(const Eigen::Vector3f& position_m) const;
  /// First crossing from free to solid space on the ray from_m + t · direction (unit), t in [near_m, far_m]. The ray
  /// passes through unknown space.
  std::optional<RayHit> raycast(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction, float near_m,
                                float far_m) const;
};

}  // namespace lumigraft::reconstruct
