#pragma once
// Fills the light volumes: all light that does not depend on the camera, computed once for a room, its lamps and the
// objects.
#include <functional>
#include <memory>
#include <vector>

#include "relight/passes/lpv/lpv.h"
#include "relight/passes/volume/bounce.h"
#include "relight/passes/volume/inject.h"
#include "relight/passes/volume/light_volume_state.h"
#include "relight/passes/volume/object_light.h"
#include "relight/passes/volume/surface_fill.h"
#include "relight/upload/brick_pool.h"

namespace lumigraft::relight {

/// One step of the update; steps run in order.
struct LightStep {
  const char* pass;
  float cost;  ///< relative to the other steps
  std::function<void(gpu::CommandList&)> record;
  std::function<void()> on_host = {};  ///< runs on the CPU in place of `record`, after all commands before it
};

class LightVolumeBuilder {
 public:
  explicit LightVolumeBuilder(gpu::Device& device);
  void fit(const Plan& plan);

  struct Work {
    shader::FrameParams params;
    LightKey key;
    bool live = false;  ///< also light that mirrors send to real surfaces, and at vertices of matt objects
    const LampMaps* maps = nullptr;
    float brightest = 0;  ///< highest radiance of the environment and of the camera's range, W/sr/m²
    int slices = 1;       ///< number of slices that long passes are split into
  };
  /// The steps that remain where `room` holds older light. The bricks must hold the room of `work`; all arguments must
  /// stay unchanged until the last step has been recorded and has run.
  std::vector<LightStep> steps(const Work& work, const BrickPool& bricks, const gpu::Texture& white,
                               LightVolumeState& room);

  const Inject& inject() const { return *inject_; }
  ObjectLight& object_light() { return object_light_; }
  const ObjectLight& object_light() const { return object_light_; }
  const Lpv* lpv() const { return lpv_.get(); }  ///< null if cones carry the change

 private:
  void add_chunks(const Work& work, const BrickPool& bricks, bool real, LightVolumeState& room,
                  std::vector<LightStep>* steps);
  void add_surfaces(const Work& work, const BrickPool& bricks, LightVolumeState& room, std::vector<LightStep>* steps);
  void add_resolve(const Work& work, const LightVolumeState& room, std::vector<LightStep>* steps);
  void add_enclosure_change(const Work& work, LightVolumeState& room, std::vector<LightStep>* steps);
  void add_real_gather(const Work& work, const LightVolumeState& room, const char* pass, int round,
                       std::vector<LightStep>* steps);

  gpu::Device& device_;
  SurfaceFill fill_;
  std::unique_ptr<Inject> inject_;
  int rsm_ = 0;
  Bounce bounce_;
  std::unique_ptr<Lpv> lpv_;
  ObjectLight object_light_;
};

}  // namespace lumigraft::relight
