#pragma once
// Shadows of the objects on real surfaces, rendered from the lamps: soft shadow maps (thesis eq. 5.20), made once for a
// room, its lamps and the objects. The part that depends on the room and the lamps only is kept while objects move. In:
// the lamp maps, the distance volumes, real_normal. Out: one image per lamp, stacked vertically.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/volume/light_volume_state.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class LampShadows {
 public:
  /// Images of edge² texels for `max_lamps` lamps; smaller ones if these would exceed the size of a texture.
  LampShadows(gpu::Device& device, int edge_px, int max_lamps);

  /// False if a lamp is too near to the objects for a planar projection of them.
  static bool possible(const shader::FrameParams& params);
  /// Fills params.shadow_views.
  static void choose_views(shader::FrameParams& params);

  void record(gpu::CommandList& list, const shader::FrameParams& params, const LampMaps& maps,
              const LightVolumeState& room);
  /// Reads the images back from the device, for shades().
  void read(gpu::Device& device, const shader::FrameParams& params);

  /// Whether objects may occlude a lamp seen from a point (tag frame).
  bool shades(const Eigen::Vector3f& at) const;

  int edge_px() const { return edge_; }
  const gpu::Texture& texture() const { return *shadows_; }  ///< occluded fraction; depth

 private:
  int edge_, blocks_;
  std::unique_ptr<gpu::ComputePipeline> ground_, tiles_, shadow_;
  std::unique_ptr<gpu::Texture> ground_place_, ground_normal_, shadows_;
  std::unique_ptr<gpu::Buffer> hiding_;        ///< lamp maps that occlude, per block
  std::optional<RealKey> ground_of_;           ///< the room that the shadow receiver map was made for
  std::vector<Eigen::Vector4f> ground_views_;  ///< and its lamp views
  // As read back.
  std::vector<shader::ShadowView> views_;
  std::vector<Eigen::Vector3f> lamps_m_;
  std::vector<char> shaded_;  ///< blocks that contain or border a shadow, per lamp
};

}  // namespace lumigraft::relight
