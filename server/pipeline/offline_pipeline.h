#pragma once
// The pipeline as one function, frame by frame on the caller's thread: no frame is dropped, no result depends on a
// clock, and the same frames give the same images on every run.
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "reconstruct/scene_builder.h"
#include "relight/compose/held_depth.h"
#include "relight/objects/standing.h"
#include "relight/planner.h"
#include "relight/renderer.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

struct FrameRecord {
  reconstruct::Scene scene;
  std::array<float, 3> color_gain{};  ///< of the frame (capture::FrameSet)
  relight::RelitPicture picture;
  std::map<std::string, reconstruct::StageCost> stages;
  std::vector<std::string> warnings;         ///< of all stages, in the order in which they ran
  std::vector<relight::PlanChoice> choices;  ///< of plan values that were adapted to the scene
};

class OfflinePipeline {
 public:
  using MakeDevice = std::function<std::shared_ptr<relight::gpu::Device>()>;

  /// `oracle` may be null; `make_device` is not called if the plan's method needs no device.
  OfflinePipeline(const capture::Session& session, relight::Exhibit exhibit, const relight::Plan& plan,
                  MakeDevice make_device, const std::shared_ptr<Oracle>& oracle,
                  const reconstruct::FusionSettings& fusion = {});

  /// Call before the first frame: where the tags are, as learnt before.
  void restore_tag_map(reconstruct::TagMap::State learnt) { builder_.restore_tag_map(std::move(learnt)); }
  /// Call before the first frame: the room, as kept before.
  void restore_room(reconstruct::KeptRoom kept) { builder_.restore_room(std::move(kept)); }
  /// An exception of a stage becomes a warning of the frame. If the device is lost, the frame is rendered again on a
  /// new one; other gpu::GpuErrors are rethrown, since there is no image then.
  FrameRecord step(const capture::FrameSet& frame, bool with_maps);

 private:
  void make();

  capture::Session session_;
  relight::Exhibit exhibit_;
  relight::Plan plan_;
  relight::Planner planner_;
  relight::Standing standing_;
  MakeDevice make_device_;
  OracleParts truth_;
  std::unique_ptr<relight::Renderer> renderer_;
  relight::HeldDepth held_depth_;
  reconstruct::SceneBuilder builder_;
};

}  // namespace lumigraft::server
