#pragma once
// Shadows of the objects on real surfaces, rendered from the lamps: soft shadow maps (thesis eq. 5.20), made once for a
// room, its lamps and the objects. The part that depends on the room and the lamps only is kept while objects move. In:
// the lamp maps, the distance volumes, real_normal. Out: one image per lamp, stacked vertically.
#include <cstdint>

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

  /// Before `record`, in place of the whole receiver map within it: updates the map over receiver_frames, a part of
  /// the lamps in each. Until it is done params.shadow_views are those of the last map. False if there is none of these
  /// lamps.
  bool update_receivers(gpu::Device& device, gpu::CommandList& list, shader::FrameParams& params,
                        const LightVolumeState& room);
  bool updating_receivers() const { return next_.of.has_value(); }
  /// Whether the images are of other receivers than those of the last `record`.
  bool other_receivers() const { return recorded_ != receivers_; }
  void record(gpu::CommandList& list, const shader::FrameParams& params, const LampMaps& maps,
              const LightVolumeState& room);
  /// Reads back from the device where the images have shadows, for shades().
  void read(gpu::Device& device, const shader::FrameParams& params);

  /// Whether objects may occlude a lamp seen from a point (tag frame).
  bool shades(const Eigen::Vector3f& at) const;

  int edge_px() const { return edge_; }
  const gpu::Texture& texture() const { return *shadows_; }  ///< occluded fraction; depth

 private:
  int edge_, blocks_;
  std::unique_ptr<gpu::ComputePipeline> ground_receivers_, tiles_, shadow_;
  /// Where each lamp's light ends, of a room as volumes hold it, and views of lamps.
  struct Receivers {
    std::unique_ptr<gpu::Texture> place, normal;
    std::optional<RealKey> of;
    std::vector<Eigen::Vector4f> views;
    int gone = 0;  ///< FrameParams::gone_cells.w

    bool is_of(const LightVolumeState& room, const std::vector<Eigen::Vector4f>& of_views, int of_gone) const {
      return of && *of == *room.real && views == of_views && gone == of_gone;
    }
  };
  Receivers make_receivers(gpu::Device& device) const;
  void find_receivers(gpu::CommandList& list, shader::FrameParams params, int first_lamp, int lamps,
                      const LightVolumeState& room, const Receivers& out) const;

  Receivers ground_, next_;  ///< next_: partly found; without textures before the first time
  int next_lamp_ = 0;
  std::uint64_t receivers_ = 0, recorded_ = 0;  ///< count of maps; of which the images are
  std::unique_ptr<gpu::Texture> shadows_;
  std::unique_ptr<gpu::Buffer> hiding_, shaded_blocks_;  ///< lamp maps that occlude, and whether any does, per block
  // As read back.
  std::vector<shader::ShadowView> views_;
  std::vector<Eigen::Vector3f> lamps_m_;
  std::vector<char> shaded_;  ///< blocks that contain or border a shadow, per lamp
};

}  // namespace lumigraft::relight
