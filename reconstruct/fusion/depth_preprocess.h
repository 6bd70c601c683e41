#pragma once
// A depth picture made ready for fusion: what plane is seen where, how far to trust it, and where depth jumps.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {

struct PreparedDepth {
  /// What a block of 2 × 2 pixels sees.
  struct Block {
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, camera frame, away from the camera
    float distance_m = 0;                              ///< of the plane: normal · p = distance_m
    float weight = 0;                                  ///< (smallest σ / σ)², at most 1; 0 = no plane
    float facing = 0;                                  ///< cosine of incidence
    std::int32_t jump = -1;  ///< the closest jump in depth whose reach this is in; −1 = none
  };
  /// Between two neighbouring pixels one surface ends before a farther one, or before nothing.
  struct Jump {
    Eigen::Vector2f pixel;
    std::int32_t near = 0, far = -1;  ///< pixels; far −1 = nothing measured there
    float divide = 0;                 ///< inverse depth between the two surfaces
    float voxel_pixels = 0;           ///< how large a voxel is there
  };
  /// Of kTile² pixels.
  struct Tile {
    float near_m = 0, far_m = 0;  ///< far_m 0 = nothing measured
    bool whole = true;            ///< every pixel measured
  };
  static constexpr int kTile = 16;

  int width = 0, height = 0, blocks_x = 0, blocks_y = 0, tiles_x = 0, tiles_y = 0;
  std::vector<float> inverse_depth;  ///< per pixel, 1/m; 0 = nothing measured
  std::vector<Block> blocks;
  /// The same in short, for the many voxels that see one plane and no jump: normal over distance, and the weight; that
  /// is −1 in the reach of a jump.
  std::vector<Simd4> planes;
  std::vector<Jump> jumps;
  std::vector<Tile> tiles;
  /// By pixel beside a jump, which block's plane it was found to lie on (see DepthReader); many voxels ask. −1 = none.
  mutable std::vector<std::int32_t> plane_through;
  static constexpr std::int32_t kNotAsked = -2;
  mutable std::vector<std::int32_t> asked;  ///< pixels of which that was found
  void forget_planes_through() {
    for (const std::int32_t pixel : asked) plane_through[static_cast<std::size_t>(pixel)] = kNotAsked;
    asked.clear();
  }
  float noise_scale = 0;  ///< how noisy the picture is, over the sensor noise model

  std::int32_t pixel_index(int u, int v) const { return v * width + u; }
  const Block& block_of(int u, int v) const {
    return blocks[static_cast<std::size_t>(std::min(v >> 1, blocks_y - 1) * blocks_x + std::min(u >> 1, blocks_x - 1))];
  }
};

/// How far from a jump, in voxels, what lies behind a surface is looked at with care.
constexpr float kJumpVoxels = 4;

/// Prepares depth pictures of one camera.
class DepthPreparation {
 public:
  /// Not `wide`: as a processor works that has no vectors of eight; the result is the same, to the bit.
  DepthPreparation(const capture::CameraModel& camera, double voxel_m, double far_m, bool wide = true);
  /// `depth_m` has the camera's size. Buffers of `view` are used again.
  void prepare(const capture::Image<float>& depth_m, PreparedDepth& view);
  /// x/z, y/z of a pixel's centre; NaN where it sees nothing.
  const Eigen::Vector2f& ray(std::int32_t pixel) const { return rays_[static_cast<std::size_t>(pixel)]; }
  float focal() const { return focal_; }

 private:
  void average_blocks(const PreparedDepth& view, int first_v, int end_v);
  float slope(const float* inverse_depth, std::ptrdiff_t step, int before, int after, float bend) const;
  void fit_plane(PreparedDepth& view, int u, int v) const;
  void fit_eight(PreparedDepth& view, int u, int v) const;
  void invert(const capture::Image<float>& depth_m, PreparedDepth& view, int first_v, int end_v) const;
  void find_jumps(PreparedDepth& view, int first_v, int end_v);
  void add_jump(PreparedDepth& view, int u, int v);
  void fit_planes(PreparedDepth& view) const;
  void fit_planes_wide(PreparedDepth& view) const;
  void spread_jumps(PreparedDepth& view);
  void measure_noise(PreparedDepth& view) const;
  void measure_tiles(PreparedDepth& view, int y) const;

  int width_, height_, blocks_x_, blocks_y_;
  float focal_, voxel_m_, far_m_;
  bool wide_;
  static constexpr int kObliqueSteps = 256;
  std::array<float, kObliqueSteps + 1> oblique_{};  ///< angular part of the noise, by cosine of incidence
  std::vector<Eigen::Vector2f> rays_;               ///< per pixel
  std::vector<std::uint32_t> blind_;                ///< pixels whose ray is NaN
  /// By block: x/z and y/z of its middle, pixels per unit of both, and the inverse length of (x/z, y/z, 1).
  struct BlockRays {
    std::vector<float> x, y, per_x, per_y, inverse_length;
  } block_rays_;
  std::vector<float> block_inverse_;  ///< mean inverse depth of a block on one surface; 0 = on none
  std::vector<std::uint8_t> rough_;   ///< per pixel: depth jumps between it and its neighbours to the right and below
  std::vector<std::int32_t> block_jumps_;  ///< the jump in the block, later the closest
};

}  // namespace lumigraft::reconstruct
