#include "server/lock_step.h"

#include <utility>

#include "server/camera_picture.h"
#include "server/make_renderer.h"
#include "server/scene_board.h"

namespace lumigraft {

LockStep::LockStep(const Session& session, Exhibit exhibit, const Plan& plan, std::shared_ptr<gpu::Device> device,
                   std::unique_ptr<Oracle> oracle)
    : exhibit_(std::move(exhibit)),
      plan_(plan),
      renderer_(make_renderer(session, plan, oracle ? oracle->parts() : OracleParts{}, std::move(device))),
      learner_(session, std::move(oracle)) {}

FrameRecord LockStep::step(const FrameSet& sensed, bool with_maps) {
  LearntFrame learnt = learner_.learn(sensed);
  FrameRecord record{.scene = std::move(learnt.scene),
                     .picture = {},
                     .stages = std::move(learnt.stages),
                     .warnings = std::move(learnt.warnings)};
  const CostClock clock;
  try {
    record.picture = renderer_->relight(learnt.frame, record.scene, exhibit_, plan_, with_maps);
  } catch (const gpu::GpuError&) {
    throw;
  } catch (const std::exception& e) {
    append_warnings(record.warnings, {std::string("relight: ") + e.what()});
  }
  record.stages["relight"] = clock.elapsed();
  append_warnings(record.warnings, record.picture.warnings);
  if (record.picture.srgb.empty()) {
    record.picture.srgb = camera_picture(*sensed.color);
  }
  return record;
}

}  // namespace lumigraft
