#pragma once
// What one depth picture says about one voxel.
#include <Eigen/Geometry>
#include <cmath>

#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/projection.h"

namespace lumigraft::reconstruct {

struct Reading {
  float distance_m = 0;  ///< may be beyond truncation
  float weight = 0;      ///< 0 = nothing
  float facing = 0;
  Eigen::Vector3f normal;  ///< of the plane that is measured to, away from the camera
  bool edge = false;       ///< depth jumps between the pixels around
  bool in_sight = true;    ///< false: the voxel is hidden or out of the picture, its colour is another's
};

/// Weight of what is read beside a jump in depth, or beyond the picture's edge.
constexpr float kEdgeTrust = 0.25f;
/// How far along a grazing ray, in truncation distances, a surface is solid.
constexpr float kBehindSteep = 2.5f;

constexpr float kRimVoxels = 1.5f;  ///< so close to its rim a surface is solid only near itself
constexpr float kNearestReadM = 0.3f;

class DepthReader {
 public:
  DepthReader(const PreparedDepth& view, const DepthPreparation& preparation, const PixelMap& map, float voxel_m,
              float truncation_m, float shell_m)
      : view_(view),
        preparation_(preparation),
        map_(map),
        voxel_m_(voxel_m),
        truncation_m_(truncation_m),
        shell_m_(shell_m),
        steady_to_m_(steady_to_m()) {}

  /// A voxel outside the picture, deeper than this or more pixels away from it, is told nothing of.
  float beyond_to_m() const { return steady_to_m_; }
  float beyond_to_pixels() const { return kRimVoxels * voxel_m_ * preparation_.focal() / kNearestReadM; }

  /// Of a voxel (camera frame) seen at `pixel`, which may lie outside the picture.
  Reading read(const Eigen::Vector3f& p, const Eigen::Vector2f& pixel) const {
    const float x = pixel.x() + 0.5f, y = pixel.y() + 0.5f;
    if (!(x >= 0 && y >= 0 && x < static_cast<float>(2 * view_.blocks_x) && y < static_cast<float>(2 * view_.blocks_y)))
      return beyond_picture(p, pixel);
    const int u = static_cast<int>(x), v = static_cast<int>(y);
    const PreparedDepth::Block& block = view_.blocks[static_cast<std::size_t>((v >> 1) * view_.blocks_x + (u >> 1))];
    if (block.jump < 0) return from_plane(p, block, block.distance_m);
    return near_jump(p, u, v, block);
  }

 private:
  /// To the plane, not along the ray, so that distances hold at grazing views too.
  Reading from_plane(const Eigen::Vector3f& p, const PreparedDepth::Block& block, float distance_m) const {
    const float to_voxel = block.normal.dot(p);
    const float distance = distance_m - to_voxel;
    Reading reading;
    if (distance < -truncation_m_ || distance * p.z() < -kBehindSteep * truncation_m_ * to_voxel) return reading;
    reading.distance_m = distance;
    reading.weight = block.weight;
    reading.facing = block.facing;
    reading.normal = block.normal;
    return reading;
  }
  Reading near_jump(const Eigen::Vector3f& p, int u, int v, const PreparedDepth::Block& block) const;
  Reading beyond_picture(const Eigen::Vector3f& p, const Eigen::Vector2f& pixel) const;
  Reading hidden(const Eigen::Vector3f& p, std::int32_t behind) const;
  bool stands(const Eigen::Vector3f& foot, const PreparedDepth::Jump& jump, const PreparedDepth::Block& block,
              float distance_m) const;
  bool seen_at(const Eigen::Vector2f& pixel, const PreparedDepth::Block& block, float distance_m) const;
  const PreparedDepth::Block* plane_through(int u, int v) const;
  std::int32_t find_plane_through(int u, int v) const;
  float steady_to_m() const;
  Eigen::Vector3f surface(std::int32_t pixel) const {
    return preparation_.ray(pixel).homogeneous() / view_.inverse_depth[static_cast<std::size_t>(pixel)];
  }

  const PreparedDepth& view_;
  const DepthPreparation& preparation_;
  const PixelMap& map_;
  float voxel_m_, truncation_m_, shell_m_;
  float steady_to_m_;  ///< depth to which a plane may be carried on a little beyond what was measured
};

}  // namespace lumigraft::reconstruct
