#pragma once
// Slopes of one field at many points, for alignment: as DistanceField::slope, and several times faster.
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

/// Remembers the bricks that it has looked up, so that points near earlier ones need no hash look-up. Valid while the
/// field is.
class SlopeLookup {
 public:
  explicit SlopeLookup(const DistanceField& field);

  /// Value and analytic gradient of the trilinear interpolant; empty where DistanceField::slope is.
  std::optional<FieldSlope> operator()(const Eigen::Vector3f& position_m);

 private:
  struct Place {
    BrickKey key{};
    const FieldBrick* brick = nullptr;
    bool looked_up = false;
  };
  /// Bricks in a window of 16 x 16 x 4 have places of their own: at voxels of 8 mm as much as a metre. Others share.
  static constexpr int kBits[3] = {4, 4, 2};

  const FieldBrick* brick(const BrickKey& key);
  bool corners(const Eigen::Vector3i& voxel, std::array<float, 8>& distance_m);

  const DistanceField& field_;
  std::vector<Place> places_;
  std::unique_ptr<SlopeLookup> coarse_;
};

}  // namespace lumigraft::reconstruct
