#pragma once
// Changes of light since the room was fused, as the shadow of a hand: they are not part of albedo, and what the
// room reflects onto other surfaces follows them.
#include <array>
#include <cstdint>
#include <vector>

#include "relight/compose/current_depth.h"
#include "relight/gather/gbuffer.h"
#include "relight/gather/moved_occluders.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/tracing/light_samples.h"

namespace lumigraft::relight {

/// At each pixel of the camera, the ratio of the radiance of now to the fused one. Texture that voxels are too coarse
/// for has its mean in what was fused, so that the median over some voxels is a change of light. It is sharp at a
/// shadow's edge. Changes that texture explains count as none.
class LightChange {
 public:
  /// `seen`: the fused room. Pixels that depth shows before or behind it, and those that clip, take the mean around
  /// them. `tiles`: one pixel for each tile whose pixels are not in `seen`; null: all are.
  LightChange(const PosedCamera& camera, const CurrentDepth& depth, const CameraUpload& picture, float voxel_m,
              const std::vector<GBufferPixel>& seen, const TilePixels* tiles = nullptr);

  bool any() const { return any_; }
  /// Sets the albedo of pixels to that of the fused surface times the detail of the image, without changes of light.
  /// `radiance`: of the camera's image, W/sr/m².
  void exclude_from(std::vector<GBufferPixel>& seen, const capture::Image<float>& radiance) const;
  /// At pixels of the room that moved surfaces cover, the change is what these hide of the lamps.
  void predict(const RayRoom& room, const std::vector<LightSampleSet>& lamps, const MovedOccluders& moved,
               const MovedPixels& covered);
  /// On the fused room at a point, tag frame; 1 where the camera does not see it.
  Rgb at(const Eigen::Vector3f& p_m) const;
  /// Upper bound of the irradiance of lamps that objects can hide from a pixel of the fused room: what the change of
  /// light left of it, and 0. Infinite where there is no less light than before.
  Eigen::Array4f lamps_now(const std::vector<LightSampleSet>& lamps, const GBufferPixel& pixel) const;

 private:
  std::size_t pixel_at(int u, int v) const { return static_cast<std::size_t>(v * camera_.model.width + u); }
  Rgb of_pixel(std::size_t i) const;

  PosedCamera camera_;
  Eigen::Isometry3f T_camera_tag_;
  float near_m_;                     ///< to the surface of a pixel: of the same
  std::vector<float> far_m_;         ///< by pixel: of the fused room, along the ray; 0: unknown
  std::vector<std::uint8_t> codes_;  ///< by pixel and channel
  std::array<float, 256> ratios_{};  ///< by code
  bool any_ = false;
};

}  // namespace lumigraft::relight
