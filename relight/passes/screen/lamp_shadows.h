#pragma once
// Shadows of the objects on real surfaces as the lamps see them: soft shadow maps (thesis eq. 5.20) that are made once
// for a room, its lamps and the objects. What depends on the room and the lamps alone is kept while
// the objects turn. In: the lamp maps, the distance volumes, real_normal. Out: a picture for every
// lamp, one above the other.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/volume/light_volume_state.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class LampShadows {
 public:
  LampShadows(gpu::Device& device, int edge_px);

  /// False where a lamp is too near to the objects to see them in one flat picture.
  static bool possible(const shader::FrameParams& params);
  /// Fills params.shadow_views.
  static void choose_views(shader::FrameParams& params);

  void record(gpu::CommandList& list, const shader::FrameParams& params, const LampMaps& maps,
              const LightVolumeState& room);
  /// Takes the pictures from the device, for shades().
  void read(gpu::Device& device, const shader::FrameParams& params);

  /// Whether objects may stand between a point of the tag's frame and a lamp.
  bool shades(const Eigen::Vector3f& at) const;

  int edge_px() const { return edge_; }
  const gpu::Texture& texture() const { return *shadows_; }  ///< share that is hidden; depth

 private:
  int edge_, blocks_;
  std::unique_ptr<gpu::ComputePipeline> ground_, tiles_, shadow_;
  std::unique_ptr<gpu::Texture> ground_place_, ground_normal_, shadows_;
  std::unique_ptr<gpu::Buffer> hiding_;        ///< maps, by blocks
  std::optional<RealKey> ground_of_;           ///< the room in which the ground was looked for
  std::vector<Eigen::Vector4f> ground_views_;  ///< and the lamps
  // As read.
  std::vector<shader::ShadowView> views_;
  std::vector<Eigen::Vector3f> lamps_m_;
  std::vector<char> shaded_;  ///< blocks with shadow in or beside them, lamp by lamp
};

}  // namespace lumigraft::relight
