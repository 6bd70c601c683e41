#pragma once
// The whole pipeline as one function, frame by frame on the caller's thread: nothing is dropped, nothing depends on a
// clock, and the same frames give the same pictures on every run.
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "relight/planner.h"
#include "relight/renderer.h"
#include "server/pipeline/scene_learner.h"

namespace lumigraft {

struct FrameRecord {
  Scene scene;
  RelitPicture picture;
  std::map<std::string, StageCost> stages;
  std::vector<std::string> warnings;  ///< of every stage, in the order they ran
  std::vector<PlanChoice> choices;    ///< of the plan, that follow the scene
};

class OfflinePipeline {
 public:
  using MakeDevice = std::function<std::shared_ptr<gpu::Device>()>;

  /// `oracle` may be null; `make_device` is not asked where the plan's method needs none.
  OfflinePipeline(const Session& session, Exhibit exhibit, const Plan& plan, MakeDevice make_device,
           std::unique_ptr<Oracle> oracle);

  /// A stage that throws becomes a warning of the frame. Where the device is lost, another one draws the frame again.
  /// Else gpu::GpuError passes through, for there is no picture then.
  FrameRecord step(const FrameSet& frame, bool with_maps);

 private:
  void make();

  Session session_;
  Exhibit exhibit_;
  Plan plan_;
  Planner planner_;
  MakeDevice make_device_;
  OracleParts truth_;
  std::unique_ptr<Renderer> renderer_;
  SceneBuilder learner_;
};

}  // namespace lumigraft
