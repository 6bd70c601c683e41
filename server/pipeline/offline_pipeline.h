#pragma once
// The whole pipeline as one function, frame by frame on the caller's thread: nothing is dropped, nothing depends on a
// clock, and the same frames give the same pictures on every run.
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "reconstruct/scene_builder.h"
#include "relight/planner.h"
#include "relight/renderer.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

struct FrameRecord {
  reconstruct::Scene scene;
  relight::RelitPicture picture;
  std::map<std::string, reconstruct::StageCost> stages;
  std::vector<std::string> warnings;         ///< of every stage, in the order they ran
  std::vector<relight::PlanChoice> choices;  ///< of the plan, that follow the scene
};

class OfflinePipeline {
 public:
  using MakeDevice = std::function<std::shared_ptr<relight::gpu::Device>()>;

  /// `oracle` may be null; `make_device` is not asked where the plan's method needs none.
  OfflinePipeline(const capture::Session& session, relight::Exhibit exhibit, const relight::Plan& plan,
                  MakeDevice make_device, std::shared_ptr<Oracle> oracle);

  /// A stage that throws becomes a warning of the frame. Where the device is lost, another one draws the frame again.
  /// Else gpu::GpuError passes through, for there is no picture then.
  FrameRecord step(const capture::FrameSet& frame, bool with_maps);

 private:
  void make();

  capture::Session session_;
  relight::Exhibit exhibit_;
  relight::Plan plan_;
  relight::Planner planner_;
  MakeDevice make_device_;
  OracleParts truth_;
  std::unique_ptr<relight::Renderer> renderer_;
  reconstruct::SceneBuilder builder_;
};

}  // namespace lumigraft::server
