#pragma once
// Rays through the distance field for light transport. DistanceField::raycast finds crossings from free to solid space
// only. These rays also stop where a ray leaves a solid through its observed front after entering through its
// unobserved back, since light does not pass there either.
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

class FieldRays {
 public:
  explicit FieldRays(const DistanceField& field);

  /// First crossing of the surface, also of the coarse field's, in either sense, on from_m + t · direction (unit), t in
  /// [0, far_m]; metres, tag frame. The ray may start inside a solid: crossings count from the first free or unknown
  /// point on.
  std::optional<Eigen::Vector3f> first_crossing(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction,
                                                float far_m) const;
  /// Whether the segment crosses no surface.
  bool free(const Eigen::Vector3f& from_m, const Eigen::Vector3f& to_m) const;

  /// Normalised gradient at a voxel: from differences over two voxels to each side, over one, or one-sided, depending
  /// on which distances are known; zero if too few are.
  Eigen::Vector3f normal_at(const Eigen::Vector3i& voxel) const;

 private:
  static constexpr int kOutside = -1;
  /// Index of a brick in the tables, or kOutside.
  int brick_index(int x, int y, int z) const {
    x -= low_.x();
    y -= low_.y();
    z -= low_.z();
    const bool inside = static_cast<unsigned>(x) < static_cast<unsigned>(size_.x()) &&
                        static_cast<unsigned>(y) < static_cast<unsigned>(size_.y()) &&
                        static_cast<unsigned>(z) < static_cast<unsigned>(size_.z());
    return inside ? x + size_.x() * (y + size_.y() * z) : kOutside;
  }
  void measure_gaps();
  std::optional<Eigen::Vector3f> first_own_crossing(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction,
                                                    float far_m) const;
  bool has_brick_at(const Eigen::Vector3f& position_m) const;
  std::optional<float> distance_at(const Eigen::Vector3i& voxel) const;  ///< voxels; empty where unknown
  /// Distance in voxels, trilinear near the surface; empty where unknown. `voxel` is the nearest to `position` (voxels)
  /// and lies in `brick`.
  std::optional<float> distance_near(const Eigen::Vector3f& position, const Eigen::Vector3i& voxel,
                                     const FieldBrick& brick) const;

  float voxel_m_;
  /// Lowest brick and size of the tables, in bricks.
  Eigen::Vector3i low_ = Eigen::Vector3i::Zero(), size_ = Eigen::Vector3i::Zero();
  std::vector<const FieldBrick*> table_;     ///< dense grid, so that a look-up needs no hash
  std::shared_ptr<const FieldRays> coarse_;  ///< of the coarse field; null if there is none
  std::vector<std::uint8_t> gap_;            ///< chessboard distance to the nearest existing brick, up to a limit
};

}  // namespace lumigraft::reconstruct
