#pragma once
// The whole pipeline as one function, frame by frame on the caller's thread: nothing is dropped, nothing depends on a
// clock, and the same frames give the same pictures on every run.
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "relight/renderer.h"
#include "server/scene_learner.h"

namespace lumigraft {

struct FrameRecord {
  Scene scene;
  RelitPicture picture;
  std::map<std::string, StageCost> stages;
  std::vector<std::string> warnings;  ///< of every stage, in the order they ran
};

class LockStep {
 public:
  /// `oracle` may be null; `device` too, where the plan's method needs none.
  LockStep(const Session& session, Exhibit exhibit, const Plan& plan, std::shared_ptr<gpu::Device> device,
           std::unique_ptr<Oracle> oracle);

  /// A stage that throws becomes a warning of the frame; gpu::GpuError passes through, for there is no picture then.
  FrameRecord step(const FrameSet& frame, bool with_maps);

 private:
  Exhibit exhibit_;
  Plan plan_;
  std::unique_ptr<Renderer> renderer_;
  SceneLearner learner_;
};

}  // namespace lumigraft
