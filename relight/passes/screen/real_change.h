#pragma once
// The change of light on real surfaces at each pixel.
// shadow: direct change (thesis eq. 5.20); in: the distance volumes, real_position, real_normal, real_albedo,
// object_surface; out: direct_lost, mirror_lost, mirror_all.
// trace: indirect change (thesis eq. 5.21) at 1/scale of the image; in: all volumes, real_position, real_normal,
// object_surface; out: traced.
// upsample: joint bilateral filter guided by the real surface, from 1/scale (or full size) to full size; in: an image
// at 1/scale, real_position, real_normal; out: the filtered image.
// reflect: change of the specular part of known material (thesis eq. 5.22); in: all volumes, the real view,
// mirror_lost, mirror_all, camera radiance; out: mirror_gained, mirror_fraction, and both after smoothing.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class RealChange {
 public:
  explicit RealChange(gpu::Device& device);
  /// `glossy`: materials of real surfaces are known; shadows are then computed at full size. `by_mirrors`: include the
  /// light of lamps reflected by mirrors that the objects block.
  void shadow(gpu::CommandList& list, shader::FrameParams params, bool glossy, bool by_mirrors, const LampMaps& maps,
              const Volumes& volumes, const Screen& screen) const;
  void trace(gpu::CommandList& list, shader::FrameParams params, int change_cones, const Volumes& volumes,
             const Screen& screen) const;
  void upsample(gpu::CommandList& list, shader::FrameParams params, const Screen& screen, const TileList& tiles,
                const gpu::Texture& coarse, const gpu::Texture& smooth, int scale, int window) const;
  void reflect(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes, const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> matt_, glossy_, trace_, upsample_, reflect_, smooth_;
};

}  // namespace lumigraft::relight
