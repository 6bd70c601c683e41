#pragma once
// One setting on one scene: how near its picture is, and what a frame costs.
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
};

struct BenchRun {
  Measures measures;
  std::vector<std::string> warnings;  ///< of the picture that is measured
  FrameCost moving;                   ///< every object turns by 1° a frame
  FrameCost still;                    ///< nothing changes from frame to frame: what may be kept is kept
};

/// Every object turned about its own vertical.
relight::Exhibit turned(const relight::Exhibit& exhibit, double angle_rad);

/// Mean over a few frames, or a round of light in cells, after as many that are not counted; slow ones are measured
/// once.
FrameCost cost_of_turning(relight::Renderer& renderer, const capture::FrameSet& frame, const reconstruct::Scene& scene,
                          const relight::Exhibit& exhibit, const relight::Plan& plan, bool hardware);

/// Pictures larger than the truth are measured shrunk to its size.
BenchRun run_setting(relight::Renderer& renderer, const BenchScene& scene, const relight::Exhibit& exhibit,
                     const relight::Plan& plan, bool hardware);

}  // namespace lumigraft::server
