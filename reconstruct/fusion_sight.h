#pragma once
// Which bricks a depth picture tells about.
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "reconstruct/distance_field.h"
#include "reconstruct/fusion_pixels.h"
#include "reconstruct/fusion_view.h"

namespace lumigraft {

/// Nothing is fused closer to the camera.
constexpr float kNearestM = 0.05f;
/// How far along rays everything is behind what is open, in truncation distances: it is that distance itself away from
/// planes inclined by 75°.
constexpr float kOpenReach = 4;

/// One in `of` parts of the picture, spread over it evenly.
struct PictureShare {
  int of = 1, which = 0;
};

/// Bricks met of late, to know most of them again at once: one for each place of a table.
class RecentBricks {
 public:
  RecentBricks() : keys_(std::size_t{1} << 14, BrickKey{INT32_MAX, 0, 0}) {}
  /// Whether it is not among them; it is from then on.
  bool meet(const BrickKey& key) {
    BrickKey& place = keys_[BrickKeyHash{}(key) & (keys_.size() - 1)];
    // std::array's own comparison is a call.
    if (place[0] == key[0] && place[1] == key[1] && place[2] == key[2]) return false;
    place = key;
    return true;
  }

 private:
  std::vector<BrickKey> keys_;
};

/// Bricks that the truncation band of any surface seen in this share touches, in order, each once, but for most of
/// those that were `met`.
std::vector<BrickKey> bricks_on_surfaces(const DepthView& view, const DepthPreparation& preparation,
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
Sight sight_of(const BrickKey& key, const DepthView& view, const PixelMap& map, float focal,
               const Eigen::Isometry3f& T_camera_tag, float voxel_m, float truncation_m);

}  // namespace lumigraft
