#pragma once
// Rays through the distance field for light transport. Unlike DistanceField::raycast, which finds the surface in front
// of a ray, these also stop where a ray that entered a solid through its unseen back leaves it through its seen front:
// light does not pass there either.
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

class FieldRays {
 public:
  explicit FieldRays(const DistanceField& field);

  /// Place of the first crossing of the surface, in either sense, on from + t·direction, t in [0, far_m]. A start
  /// inside a solid is forgiven: what lies before the first free or unknown space does not count.
  std::optional<Eigen::Vector3f> first_crossing(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction,
                                                float far_m) const;
  bool free(const Eigen::Vector3f& from_m, const Eigen::Vector3f& to_m) const;

  /// Gradient at a voxel, normalised: over two voxels either way, one, or by single differences, as far as distances
  /// are known; zero where they are not.
  Eigen::Vector3f normal_at(const Eigen::Vector3i& voxel) const;

 private:
  static constexpr int kOutside = -1;
  /// Place of a brick in the tables, or kOutside.
  int place(int x, int y, int z) const {
    x -= low_.x();
    y -= low_.y();
    z -= low_.z();
    const bool inside = static_cast<unsigned>(x) < static_cast<unsigned>(size_.x()) &&
                        static_cast<unsigned>(y) < static_cast<unsigned>(size_.y()) &&
                        static_cast<unsigned>(z) < static_cast<unsigned>(size_.z());
    return inside ? x + size_.x() * (y + size_.y() * z) : kOutside;
  }
  void measure_gaps();
  std::optional<float> distance_at(const Eigen::Vector3i& voxel) const;  ///< voxels; empty where unknown
  /// In voxels, trilinear near the surface; empty where unknown. In `brick` is the `voxel` that is nearest to the
  /// position.
  std::optional<float> distance_near(const Eigen::Vector3f& position, const Eigen::Vector3i& voxel,
                                     const FieldBrick& brick) const;

  float voxel_m_;
  /// The tables' lowest brick and size.
  Eigen::Vector3i low_ = Eigen::Vector3i::Zero(), size_ = Eigen::Vector3i::Zero();
  std::vector<const FieldBrick*> table_;  ///< dense: a look-up costs no hash
  std::vector<std::uint8_t> gap_;         ///< bricks to the nearest that exists (chessboard), up to a limit
};

}  // namespace lumigraft::reconstruct
