#pragma once
// This frame's depth along the rays of the colour camera's pixels. It shows hands and people at once, and fused
// surfaces as exactly as its noise allows.
#include <algorithm>
#include <cmath>

#include "capture/frame.h"
#include "relight/compose/parameters.h"
#include "relight/compose/pixel_rays.h"

namespace lumigraft::relight {

/// The frame's depth if it is of the camera's size, else null.
inline const capture::Image<float>* depth_of(const capture::FrameSet& frame, const capture::CameraModel& camera) {
  if (!frame.depth) return nullptr;
  const capture::Image<float>& depth_m = frame.depth->depth_m;
  return depth_m.width == camera.width && depth_m.height == camera.height ? &depth_m : nullptr;
}

class CurrentDepth {
 public:
  /// `depth_m`: along the camera's z, of the colour camera's size, 0 where nothing was measured; null: no depth.
  CurrentDepth(const PixelRays& rays, const capture::Image<float>* depth_m, float voxel_m,
               const capture::DepthNoise& noise = {})
      : rays_(rays), depth_m_(depth_m), voxel_m_(voxel_m), noise_(noise) {}

  bool any() const { return depth_m_ != nullptr; }
  const capture::Image<float>& along_z_m() const { return *depth_m_; }
  float voxel_m() const { return voxel_m_; }  ///< of the fused room
  int width() const { return rays_.width(); }
  int height() const { return rays_.height(); }
  bool known(int u, int v) const { return depth_m_ && depth_m_->at(u, v) > 0; }
  /// Whether depth along the ray is known and less than this, metres: at() is not needed where it surely is not.
  bool nearer(int u, int v, float limit_m) const {
    return known(u, v) && depth_m_->at(u, v) < limit_m && at(u, v) < limit_m;
  }
  /// Distance along the ray through the pixel's centre, metres; 0: unknown.
  float at(int u, int v) const {
    if (!depth_m_) return 0;
    const float z = depth_m_->at(u, v), cosine = rays_.cosine(u, v);
    return z > 0 && cosine > 0 ? z / cosine : 0;
  }
  /// Whether depth is clearly before or behind a surface at this distance along the ray, metres: then it decides what
  /// hides the surface there, else the fused room does.
  bool differs(int u, int v, float distance_m) const {
    const float depth_m = at(u, v);
    return depth_m > 0 && std::abs(depth_m - distance_m) > allowed_m(depth_m);
  }
  /// What noise and the voxels of the fused surface explain of a difference from it, metres. `cosine`: of the ray to
  /// the surface's normal.
  float allowed_m(float depth_m, float cosine = 1) const {
    return noise_m(depth_m) + voxel_m_ / std::max(cosine, kCompose.moved_min_cosine);
  }
  /// What noise alone explains.
  float noise_m(float depth_m) const { return kCompose.moved_sigmas * noise_.axial_sigma_m(depth_m); }

 private:
  const PixelRays& rays_;
  const capture::Image<float>* depth_m_;
  float voxel_m_;
  capture::DepthNoise noise_;
};

}  // namespace lumigraft::relight
