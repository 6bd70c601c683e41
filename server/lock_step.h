#pragma once
// The whole pipeline as one function, frame by frame on the caller's thread: nothing is dropped, nothing depends on a
// clock, and the same frames give the same pictures on every run.
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/fusion.h"
#include "reconstruct/scene.h"
#include "relight/relighter.h"
#include "server/albedo_schedule.h"
#include "server/oracle.h"

namespace lumigraft {

struct StageCost {
  double wall_ms = 0;
  double cpu_ms = 0;  ///< user + system of the whole process: software GPUs work on threads of their own
};

struct FrameRecord {
  Scene scene;
  RelitPicture picture;
  std::map<std::string, StageCost> stages;
  std::vector<std::string> warnings;  ///< of every stage, in the order they ran
};

class LockStep {
 public:
  /// `oracle` may be null.
  LockStep(const Session& session, Exhibit exhibit, const Plan& plan, std::shared_ptr<gpu::Device> device,
           std::unique_ptr<Oracle> oracle);
  ~LockStep();

  /// A stage that throws becomes a warning of the frame; gpu::GpuError passes through, for there is no picture then.
  FrameRecord step(const FrameSet& frame, bool with_maps);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft
