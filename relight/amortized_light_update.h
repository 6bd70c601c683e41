#pragma once
// Updates the light volumes when the room, its lamps or the objects change. The update runs at once, or, in the live
// setting and for small changes, is amortized over rounds of round_frames frames. A round takes a snapshot of objects,
// lamps and room at its start and gathers their indirect light while frames are rendered; the result is faded in during
// the next round. Indirect light is therefore one to three rounds old and changes without jumps; two rounds and one
// fade after the last change it equals the result of an update at once. These rounds count frames, not time: the
// same input gives the same output.
//
// Where it is asked for (Now::budget_ms), jumps of the objects are amortized too: objects that appear, disappear or are
// put elsewhere. Such a round lasts as long as its steps take, of which each frame runs what it has time for: only
// `serve` asks for it. It starts again if the objects jump again. Until it is done new objects have the light of the
// lamps, and of the environment without occlusion.
#include <optional>

#include "relight/light_volume_builder.h"
#include "relight/parameters.h"
#include "relight/upload/light_set.h"

namespace lumigraft::relight {

class AmortizedLightUpdate {
 public:
  explicit AmortizedLightUpdate(gpu::Device& device);

  struct Now {
    const shader::FrameParams& params;
    const LightKey& key;
    const LightSet& lights;
    const LampMaps& maps;
    float brightest;
    bool live;         ///< gather at vertices too
    bool incremental;  ///< update in rounds, if the changes since the last frame are small enough
    const gpu::Texture& white;
    /// Time for a part of an update after a jump of the objects, at least one step, unless it is 0; empty: jumps are
    /// shown at once.
    std::optional<double> budget_ms = {};
  };
  struct Done {
    bool recorded = false;                   ///< commands were added to the list
    bool changed = false;                    ///< room(), irradiance() or the light at vertices changed
    std::vector<gpu::PassTime> passes = {};  ///< of the passes that ran at once
  };
  /// Call fit() first. The bricks follow the key's room at the start of a round. Throws gpu::GpuError if the surface
  /// chunks don't fit in device memory; the volumes must not be used then.
  Done advance(gpu::CommandList& list, const Now& now, BrickPool& bricks);

  /// `mirror_outlines`: of surfaces with known material; `gone_cells`: of surface that is gone. Both remain referenced.
  void fit(const Plan& plan, const gpu::Texture& mirror_outlines, const gpu::Buffer& gone_cells);
  LightVolumeBuilder& passes() { return light_; }
  const LightVolumeBuilder& passes() const { return light_; }
  /// Non-empty: device memory is too small for rounds.
  const std::string& why_no_rounds() const { return why_no_rounds_; }
  bool any_room() const { return shown_ != nullptr; }  ///< whether the last fit() allocated volumes
  LightVolumeState& room() { return *shown_; }
  const LightVolumeState& room() const { return *shown_; }
  const gpu::Texture& irradiance() const;                     ///< current change of irradiance in real cells
  bool any_light() const { return shown_->lit.has_value(); }  ///< whether the displayed volumes hold any
  /// Whether they hold it around one of the objects.
  bool reaches(const std::vector<PlacedObject>& objects) const;
  /// Light at the vertices of the objects of the last advance(), of the last two rounds, and the blend weight of the
  /// newer.
  const std::vector<const gpu::Buffer*>& older() const { return older_; }
  const std::vector<const gpu::Buffer*>& newer() const { return newer_; }
  float newer_weight() const {
    return fading_ ? std::min(static_cast<float>(frame_) / kRelight.round_frames, 1.0f) : 1.0f;
  }

 private:
  bool make_next(gpu::CommandList& list, const Now& now);
  bool begin_round(gpu::CommandList& list, const Now& now, BrickPool& bricks, bool jump);
  void go_on(gpu::CommandList& list, const Now& now, Done* done);
  Done all_at_once(gpu::CommandList& list, const Now& now, BrickPool& bricks);
  std::vector<LightStep> begin(const Now& now, int slices, BrickPool& bricks, LightVolumeState& room);
  void record_part(gpu::CommandList& list);
  void run_part(double budget_ms, Done* done);
  void find_vertex_light(gpu::CommandList& list, const Now& now, Done* done);
  void end_round();
  void fade(gpu::CommandList& list, const shader::FrameParams& params) const;

  gpu::Device& device_;
  LightVolumeBuilder light_;
  std::unique_ptr<gpu::ComputePipeline> mix_;
  std::unique_ptr<LightVolumeState> shown_, next_;  ///< next_: null before the first round
  std::optional<LightKey> last_;                    ///< of the last frame
  std::string why_no_rounds_;
  // The current round.
  std::vector<LightStep> steps_;
  std::size_t done_ = 0;
  bool running_ = false, fading_ = false;
  bool jumped_ = false;  ///< the round shows a jump
  float ms_per_cost_ = 0;
  int frame_ = 0;
  LightKey next_key_;
  // The older end of the fade.
  std::unique_ptr<gpu::Texture> older_irradiance_, mixed_irradiance_;
  shader::vec4 older_cascade_[shader::kCascades];
  ObjectsLight older_gathered_;
  // At the vertices of the objects of last_; see older(), newer().
  std::vector<const gpu::Buffer*> older_, newer_;
  ObjectsLight ungathered_;  ///< of new objects
};

}  // namespace lumigraft::relight
