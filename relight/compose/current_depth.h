#pragma once
// This frame's depth along the rays of the colour camera's pixels. It shows hands and people at once, and fused
// surfaces as exactly as its noise allows.
#include "reconstruct/math/depth_noise.h"
#include "relight/compose/parameters.h"
#include "relight/compose/pixel_rays.h"

namespace lumigraft::relight {

class CurrentDepth {
 public:
  /// `depth_m`: along the camera's z, of the colour camera's size, 0 where nothing was measured; null: no depth.
  CurrentDepth(const PixelRays& rays, const capture::Image<float>* depth_m, float voxel_m)
      : rays_(rays), depth_m_(depth_m), voxel_m_(voxel_m) {}

  bool any() const { return depth_m_ != nullptr; }
  const capture::Image<float>& along_z_m() const { return *depth_m_; }
  /// Distance along the ray through the pixel's centre, metres; 0: unknown.
  float at(int u, int v) const {
    if (!depth_m_) return 0;
    const float z = depth_m_->at(u, v), cosine = rays_.at(u, v).z();
    return z > 0 && cosine > 0 ? z / cosine : 0;
  }
  /// What noise and the voxels of the fused surface explain of a difference from it, metres. `cosine`: of the ray to
  /// the surface's normal.
  float allowed_m(float depth_m, float cosine = 1) const {
    return kCompose.moved_sigmas * reconstruct::axial_sigma_m(depth_m) +
           voxel_m_ / std::max(cosine, kCompose.moved_min_cosine);
  }

 private:
  const PixelRays& rays_;
  const capture::Image<float>* depth_m_;
  float voxel_m_;
};

}  // namespace lumigraft::relight
