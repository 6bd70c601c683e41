#pragma once
// Runs one setting on one scene: error of its picture and cost of a frame.
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/stage_cost.h"
#include "relight/renderer.h"
#include "server/bench/bench_session.h"
#include "server/bench/measures.h"

namespace lumigraft::server {

struct FrameCost {
  reconstruct::StageCost host;   ///< relight alone
  std::optional<double> gpu_ms;  ///< between the device's timestamps; of hardware alone
  /// Of each pass of relight, in order: wall time on the processor, or between the device's timestamps.
  std::vector<relight::gpu::PassTime> passes;
};

struct BenchRun {
  Measures measures;
  std::vector<std::string> warnings;  ///< of the scored picture
  FrameCost moving;                   ///< every object turns by 1° per frame
  FrameCost still;                    ///< static scene: results may be reused between frames
};

/// Turns every object about its own vertical axis.
relight::Exhibit turned(const relight::Exhibit& exhibit, double angle_rad);

/// Mean over a few frames, or over one cycle of amortized light updates, after as many warm-up frames; slow settings
/// are measured once.
FrameCost cost_of_turning(relight::Renderer& renderer, const capture::FrameSet& frame, const reconstruct::Scene& scene,
                          const relight::Exhibit& exhibit, const relight::Plan& plan, bool hardware);

/// Pictures larger than the truth are downscaled to its size before scoring.
BenchRun run_setting(relight::Renderer& renderer, const BenchScene& scene, const relight::Exhibit& exhibit,
                     const relight::Plan& plan, bool hardware);

}  // namespace lumigraft::server
