#pragma once
// From frames to the scene, frame by frame on the caller's thread: pose, light, geometry and albedo in a fixed order.
// Nothing is dropped, nothing depends on a clock, and the same frames give the same scene on every run.
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "reconstruct/scene.h"
#include "server/metrics/stage_cost.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

struct BuildResult {
  capture::FrameSet frame;  ///< as sensed, but for true depth where the oracle has it
  reconstruct::Scene scene;
  std::map<std::string, StageCost> stages;
  std::vector<std::string> warnings;  ///< of every stage, in the order they ran
};

class SceneBuilder {
 public:
  /// `oracle` may be null.
  SceneBuilder(const capture::Session& session, std::unique_ptr<Oracle> oracle);
  ~SceneBuilder();

  /// A stage that throws becomes a warning of the frame.
  BuildResult learn(const capture::FrameSet& sensed);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
