#include "server/pipeline/offline_pipeline.h"

#include <utility>

#include "reconstruct/scene_store.h"
#include "server/pipeline/camera_picture.h"
#include "server/pipeline/exhibit_state.h"
#include "server/pipeline/make_renderer.h"

namespace lumigraft::server {

OfflinePipeline::OfflinePipeline(const capture::Session& session, relight::Exhibit exhibit, const relight::Plan& plan,
                                 MakeDevice make_device, const std::shared_ptr<Oracle>& oracle,
                                 const reconstruct::FusionSettings& fusion)
    : session_(session),
      exhibit_(std::move(exhibit)),
      plan_(plan),
      planner_(plan),
      make_device_(std::move(make_device)),
      truth_(oracle ? oracle->parts() : OracleParts{}),
      held_depth_(session.color.model),
      builder_(session, overrides_of(oracle), std::make_unique<reconstruct::FramePace>(), fusion) {
  make();
}

void OfflinePipeline::make() {
  renderer_ = make_renderer(session_, plan_, truth_, plan_.on_device() ? make_device_() : nullptr);
}

FrameRecord OfflinePipeline::step(const capture::FrameSet& sensed, bool with_maps) {
  reconstruct::BuildResult built = builder_.build(sensed);
  FrameRecord record{.scene = std::move(built.scene),
                     .color_gain = built.frame.color_gain,
                     .picture = {},
                     .stages = std::move(built.stages),
                     .warnings = std::move(built.warnings),
                     .choices = {}};
  const reconstruct::CostClock clock;
  const double time_s = 1e-9 * static_cast<double>(sensed.time_ns);
  const relight::Exhibit exhibit = shown_exhibit(exhibit_, record.scene, time_s, standing_);
  relight::Planner::Decision decision = planner_.decide(record.scene, exhibit, time_s);
  record.choices = std::move(decision.choices);
  const capture::FrameSet frame = held_depth_.complete(built.frame, record.scene.pose);
  try {
    if (!renderer_) make();  // the device was lost during the previous frame, and creating another failed
    try {
      record.picture = renderer_->relight(frame, record.scene, exhibit, decision.plan, with_maps);
    } catch (const relight::gpu::DeviceLost& e) {
      reconstruct::append_warnings(
          record.warnings, {std::string("the GPU device was lost, the frame is rendered on a new one: ") + e.what()});
      renderer_.reset();  // frees the device before another is created
      make();
      record.picture = renderer_->relight(frame, record.scene, exhibit, decision.plan, with_maps);
    }
  } catch (const relight::gpu::GpuError&) {
    throw;
  } catch (const std::exception& e) {
    reconstruct::append_warnings(record.warnings, {std::string("relight: ") + e.what()});
  }
  record.stages["relight"] = clock.elapsed();
  reconstruct::append_warnings(record.warnings, record.picture.warnings);
  if (record.picture.srgb.empty()) record.picture.srgb = camera_picture(*sensed.color);
  return record;
}

}  // namespace lumigraft::server
