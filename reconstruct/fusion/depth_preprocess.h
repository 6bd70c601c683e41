#pragma once
// Preprocessing of a depth image for fusion: local planes with weights from the noise model, and jumps in depth.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/depth_noise.h"
#include "capture/image.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {

struct PreparedDepth {
  /// Plane observed by a block of 2 × 2 pixels.
  struct Block {
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, camera frame, away from the camera
    float distance_m = 0;                              ///< of the plane: normal · p = distance_m
    float weight = 0;                                  ///< (kMinDepthSigma_m / σ)², at most 1; 0 = no plane
    float facing = 0;                                  ///< cosine of incidence
    std::int32_t jump = -1;                            ///< the closest jump in depth within reach; −1 = none
  };
  /// Depth discontinuity between neighbouring pixels: a surface ends in front of a farther one, or of no measurement.
  struct Jump {
    Eigen::Vector2f pixel;            ///< its position
    std::int32_t near = 0, far = -1;  ///< pixel indices; far −1 = nothing measured there
    float divide = 0;                 ///< inverse depth between the two surfaces
    float voxel_pixels = 0;           ///< size of a voxel at the near surface, pixels
    Eigen::Vector3f near_m;           ///< the point of pixel `near`, camera frame
    Eigen::Vector2f inside;           ///< unit vector in the image, towards that pixel
    float occlusion_px = 0;           ///< so near to it the near surface may hide the far one; 0 = none is there
  };
  /// What kTile × kTile pixels measured.
  struct Tile {
    float near_m = 0;      ///< smallest depth; 0 = nothing measured
    float hidden_m = 0;    ///< depth behind which nothing is observed; 0 = nothing at all is
    bool complete = true;  ///< every pixel has a measurement
    bool jumps = false;    ///< some voxels need a jump
  };
  static constexpr int kTile = 8;

  int width = 0, height = 0, blocks_x = 0, blocks_y = 0, tiles_x = 0, tiles_y = 0;
  std::vector<float> inverse_depth;  ///< per pixel, 1/m; 0 = nothing measured
  std::vector<Block> blocks;
  std::vector<Simd4> planes;  ///< per block: normal / distance, and the distance
  /// Per block the weight. Within reach of a jump it is negative where what is in front of the plane, beyond its shell,
  /// is observed as on any plane; and kJump where the jump itself is needed, up to the depth `jump_depth_m`. 0 also
  /// where no pixel has a measurement.
  std::vector<float> plane_weights;
  static constexpr float kJump = -2;
  std::vector<float> jump_depth_m;
  std::vector<Jump> jumps;
  std::vector<Tile> tiles;
  /// Cache of DepthLookup by pixel: the block whose plane contains a pixel next to a jump; −1 = none.
  mutable std::vector<std::int32_t> plane_cache;
  static constexpr std::int32_t kNotCached = -2;
  mutable std::vector<std::int32_t> behind_cache;   ///< likewise by jump: the block of its far surface
  mutable std::vector<std::int32_t> cached_pixels;  ///< pixels with an entry
  void clear_plane_cache() {
    for (const std::int32_t pixel : cached_pixels) plane_cache[static_cast<std::size_t>(pixel)] = kNotCached;
    cached_pixels.clear();
  }
  float noise_scale = 0;  ///< noise of the image relative to the sensor noise model

  std::int32_t pixel_index(int u, int v) const { return v * width + u; }
  const Block& block_of(int u, int v) const {
    return blocks[static_cast<std::size_t>(std::min(v >> 1, blocks_y - 1) * blocks_x + std::min(u >> 1, blocks_x - 1))];
  }
};

/// A plane seen at a grazing angle.
struct SteepPlane {
  float inverse_depth = 0;   ///< 1/m, at the centre of its block
  float by_u = 0, by_v = 0;  ///< its slope, per pixel
};

/// Preprocesses depth images of one camera.
class DepthPreprocessor {
 public:
  /// `wide` false: without vectors of eight floats, as on processors that lack them; the result is bit-identical.
  DepthPreprocessor(const capture::CameraModel& camera, double voxel_m, double truncation_m, double far_m,
                    bool wide = true, const capture::DepthNoise& noise = {});
  /// `depth_m` has the camera's size. Reuses the buffers of `view`.
  void prepare(const capture::Image<float>& depth_m, PreparedDepth& view);
  /// x/z, y/z of a pixel's centre; NaN where the lens model has no ray.
  const Eigen::Vector2f& ray(std::int32_t pixel) const { return rays_[static_cast<std::size_t>(pixel)]; }
  const std::vector<Eigen::Vector2f>& rays() const { return rays_; }
  float focal() const { return focal_; }
  const capture::DepthNoise& noise() const { return noise_; }

 private:
  void average_blocks(const PreparedDepth& view, int first_v, int end_v);
  float slope(const float* inverse_depth, std::ptrdiff_t step, int before, int after, float bend) const;
  void fit_plane(PreparedDepth& view, int u, int v);
  void set_plane(PreparedDepth& view, std::size_t block, float inverse_depth, float by_u, float by_v);
  void fit_eight_planes(PreparedDepth& view, int u, int v);
  void invert(const capture::Image<float>& depth_m, PreparedDepth& view, int first_v, int end_v) const;
  void find_jumps(PreparedDepth& view, int first_v, int end_v);
  void add_jump(PreparedDepth& view, int u, int v);
  void accept_steep_planes(PreparedDepth& view);
  void fit_planes(PreparedDepth& view);
  void fit_planes_wide(PreparedDepth& view);
  void set_steep_planes(PreparedDepth& view);
  void spread_jumps(PreparedDepth& view);
  void mark_jump(PreparedDepth& view, int u, int v);
  void measure_hidden(PreparedDepth& view) const;
  void measure_noise(PreparedDepth& view) const;
  void measure_tiles(PreparedDepth& view, int y) const;

  int width_, height_, blocks_x_, blocks_y_;
  float focal_, voxel_m_, truncation_m_, far_m_;
  capture::DepthNoise noise_;
  bool wide_;
  static constexpr int kObliqueSteps = 256;
  std::array<float, kObliqueSteps + 1> oblique_{};  ///< angular part of the noise, by cosine of incidence
  std::vector<Eigen::Vector2f> rays_;               ///< per pixel
  std::vector<std::uint32_t> no_ray_;               ///< indices of pixels without a ray, sorted
  /// By block: x/z and y/z of its centre, pixels per unit of both, and the inverse length of (x/z, y/z, 1).
  struct BlockRays {
    std::vector<float> x, y, per_x, per_y, inverse_length;
  } block_rays_;
  std::vector<float> block_inverse_;         ///< mean inverse depth of a block on one surface; 0 = otherwise
  std::vector<float> block_hidden_m_;        ///< depth behind which a block observes nothing; 0 = nothing at all
  std::vector<std::uint8_t> discontinuous_;  ///< per pixel: depth jumps between it and its right and lower neighbours
  std::vector<std::int32_t> block_jumps_;    ///< per block: the jump in it, then the closest
  std::vector<std::pair<std::size_t, SteepPlane>> steep_;  ///< by block
  std::vector<Simd4> jump_reach_;  ///< per jump: its pixel, and the square of its reach in pixels
};

}  // namespace lumigraft::reconstruct
