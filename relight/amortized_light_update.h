#pragma once
// Keeps the light volumes up with the room, its lamps and the objects: all at once, or, in the live setting while
// things move little by little, in rounds of kRoundFrames frames. A round takes the objects, lamps and room as they are
// when it begins and gathers their indirect light while pictures go on; then it is faded in while the next round runs.
// So indirect light is between one and three rounds old, never jumps, and two rounds and a fade after everything stands
// still it is what would have been gathered at once. Frames are counted, not time: the same input gives the same
// pictures.
#include "relight/light_volume_builder.h"

namespace lumigraft::relight {

class AmortizedLightUpdate {
 public:
  static constexpr int kRoundFrames = 24;

  explicit AmortizedLightUpdate(gpu::Device& device);

  struct Now {
    const shader::FrameParams& params;
    const LightKey& key;
    const LightSet& lights;
    const LampMaps& maps;
    float brightest;
    bool live;         ///< also on vertices
    bool incremental;  ///< in rounds, if what has changed since the last frame allows it
    const gpu::Texture& white;
  };
  struct Done {
    bool recorded = false;                   ///< something into the list
    bool changed = false;                    ///< what room(), irradiance() or the light of vertices show
    std::vector<gpu::PassTime> passes = {};  ///< of what had to run at once
  };
  /// Before: fit() to the plan. The bricks follow the key's room as rounds begin. Throws gpu::GpuError where the device
  /// has no room for what the volumes hold of surfaces; then they are of no use.
  Done advance(gpu::CommandList& list, const Now& now, BrickPool& bricks);

  /// `mirror_outlines`: of known surfaces.
  void fit(const Plan& plan, const gpu::Texture& mirror_outlines);
  LightVolumeBuilder& passes() { return light_; }
  const LightVolumeBuilder& passes() const { return light_; }
  const std::string& why_no_rounds() const { return why_no_rounds_; }  ///< the device has no room for them; else empty
  bool any_room() const { return shown_ != nullptr; }                  ///< whether the last fit() left volumes
  LightVolumeState& room() { return *shown_; }
  const LightVolumeState& room() const { return *shown_; }
  const gpu::Texture& irradiance() const;  ///< change of it in real cells, as it is now
  /// Two rounds of light on the objects' vertices, and the share of the newer.
  const VertexLight& older() const { return older_gathered_; }
  const VertexLight& newer() const { return shown_->gathered; }
  float share() const { return fading_ ? static_cast<float>(frame_) / kRoundFrames : 1.0f; }

 private:
  bool make_next();
  Done all_at_once(gpu::CommandList& list, const Now& now, BrickPool& bricks);
  std::vector<LightStep> begin(const Now& now, int slices, BrickPool& bricks, LightVolumeState& room);
  void record_part(gpu::CommandList& list);
  void end_round();
  void fade(gpu::CommandList& list, const shader::FrameParams& params) const;

  gpu::Device& device_;
  LightVolumeBuilder light_;
  std::unique_ptr<gpu::ComputePipeline> mix_;
  std::unique_ptr<LightVolumeState> shown_, next_;  ///< next_: null before the first round
  std::optional<LightKey> last_;                    ///< of the last frame
  std::string why_no_rounds_;
  // The round under way.
  std::vector<LightStep> steps_;
  std::size_t done_ = 0;
  bool running_ = false, fading_ = false;
  int frame_ = 0;
  LightKey next_key_;
  // What is faded from.
  std::unique_ptr<gpu::Texture> older_irradiance_, mixed_irradiance_;
  shader::vec4 older_cascade_[shader::kCascades];
  VertexLight older_gathered_;
};

}  // namespace lumigraft::relight
