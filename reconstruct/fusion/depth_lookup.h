#pragma once
// The observation of one voxel in one depth image.
#include <Eigen/Geometry>

#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/parameters.h"
#include "reconstruct/fusion/projection.h"

namespace lumigraft::reconstruct {

struct DepthReading {
  float distance_m = 0;    ///< signed, to the observed plane; may exceed the truncation distance
  float weight = 0;        ///< 0 = not observed
  float facing = 0;        ///< cosine of incidence
  Eigen::Vector3f normal;  ///< of the plane, away from the camera
  bool edge = false;       ///< depth jumps between the pixels around
  bool visible = true;     ///< false: the voxel is hidden or outside the image, so its pixel shows another surface
};

class DepthLookup {
 public:
  DepthLookup(const PreparedDepth& view, const DepthPreprocessor& preprocessor, const PixelMap& map, float voxel_m,
              float truncation_m, float shell_m)
      : view_(view),
        preprocessor_(preprocessor),
        map_(map),
        voxel_m_(voxel_m),
        truncation_m_(truncation_m),
        shell_m_(shell_m),
        steady_depth_m_(steady_depth_m()) {}

  /// A voxel outside the image is not observed if it is deeper than this, or more pixels away from the image.
  float extrapolation_depth_m() const { return steady_depth_m_; }
  float extrapolation_px() const {
    return kDepthLookup.rim_voxels * voxel_m_ * preprocessor_.focal() / kDepthLookup.min_depth_m;
  }

  /// Observes a voxel at `p` (camera frame, metres) that projects to `pixel`, which may be outside the image.
  DepthReading read(const Eigen::Vector3f& p, const Eigen::Vector2f& pixel) const {
    const float x = pixel.x() + 0.5f, y = pixel.y() + 0.5f;
    if (!(x >= 0 && y >= 0 && x < static_cast<float>(2 * view_.blocks_x) && y < static_cast<float>(2 * view_.blocks_y)))
      return outside_image(p, pixel);
    const int u = static_cast<int>(x), v = static_cast<int>(y);
    const PreparedDepth::Block& block = view_.blocks[static_cast<std::size_t>((v >> 1) * view_.blocks_x + (u >> 1))];
    if (block.jump < 0) return from_plane(p, block, block.distance_m);
    return near_jump(p, u, v, block);
  }

 private:
  /// The distance is to the plane, not along the ray, so that it is right at grazing angles too.
  DepthReading from_plane(const Eigen::Vector3f& p, const PreparedDepth::Block& block, float distance_m) const {
    const float to_voxel = block.normal.dot(p);
    const float distance = distance_m - to_voxel;
    DepthReading reading;
    if (distance < -truncation_m_ || distance * p.z() < -kDepthLookup.behind_grazing * truncation_m_ * to_voxel)
      return reading;
    reading.distance_m = distance;
    reading.weight = block.weight;
    reading.facing = block.facing;
    reading.normal = block.normal;
    return reading;
  }
  DepthReading near_jump(const Eigen::Vector3f& p, int u, int v, const PreparedDepth::Block& block) const;
  DepthReading outside_image(const Eigen::Vector3f& p, const Eigen::Vector2f& pixel) const;
  DepthReading hidden_surface(const Eigen::Vector3f& p, std::int32_t behind) const;
  bool visible_on_plane(const Eigen::Vector3f& foot, const PreparedDepth::Jump& jump, const PreparedDepth::Block& block,
                        float distance_m) const;
  bool visible_at(const Eigen::Vector2f& pixel, const PreparedDepth::Block& block, float distance_m) const;
  const PreparedDepth::Block* plane_block(int u, int v) const;
  std::int32_t find_plane_block(int u, int v) const;
  float steady_depth_m() const;
  Eigen::Vector3f surface(std::int32_t pixel) const {
    return preprocessor_.ray(pixel).homogeneous() / view_.inverse_depth[static_cast<std::size_t>(pixel)];
  }

  const PreparedDepth& view_;
  const DepthPreprocessor& preprocessor_;
  const PixelMap& map_;
  float voxel_m_, truncation_m_, shell_m_;
  float steady_depth_m_;  ///< depth up to which a plane may be extrapolated beyond its pixels
};

}  // namespace lumigraft::reconstruct
