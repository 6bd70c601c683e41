#pragma once
// What relight decided to do for a frame: a plain value, printed, recorded, settable by hand (plan.KEY).
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "capture/session/config.h"

namespace lumigraft::relight {

struct Quality;

struct Plan {
  /// How the change of light reaches real surfaces: "dvct", by cones; "dlpv", from cell to cell; "rays", by rays that
  /// end on surfaces, without a GPU. "reference": path tracing, which reads `samples` and nothing else of the plan.
  std::string method = "dvct";
  int volume = 64;  ///< voxels along the edge of each cascade: 32, 64, 128 or 256
  /// Light is traced at 1/trace_scale of the picture: 1, 2 or 4. 4 is live, which takes cells = 1; by rays 8 is.
  int trace_scale = 2;
  int cells = 0;       ///< 1: indirect light is gathered in cells of the volumes, in rounds of frames; 0: for pixels
  int rsm = 256;       ///< edge of the reflective shadow maps, pixels
  int max_lights = 8;  ///< strongest lamps that are drawn as lamps, at most shader::kMaxLamps
  int sh_bands = 3;    ///< bands of harmonics that stand for all light but the lamps where nothing hides it: 1, 2 or 3
  int bounces = 2;     ///< indirect bounces of the change: 1 is the thesis
  int lpv_steps = 16;  ///< dlpv: steps of propagation, each of a cell (two voxels of up to 128)
  int rays = 20;       ///< rays: of a place on an object, or of a pixel that is gathered for
  int samples = 64;    ///< camera paths a pixel; of the reference alone
  int adaptive = 1;    ///< 1: what was not set by hand follows what the scene measures (planner.h); 0: nothing
  std::set<std::string> user_set;  ///< keys that were set by hand: nothing changes them
  /// In place of what quality_of() derives; no key of a file sets it. Benchmarks draw other methods' settings by it.
  std::shared_ptr<const Quality> quality;

  /// Whether the method draws on a device, by lamps, bands and maps of the plan; the others read all that is known.
  bool on_device() const { return method != "reference" && method != "rays"; }
  bool in_cells() const { return (method == "dvct" || method == "dlpv") && (cells == 1 || trace_scale == 4); }
};

/// Reads the optional table [plan] over `defaults`, and which keys it sets; the caller calls root.finish().
Plan read_plan(const capture::ConfigTable& root, const Plan& defaults);

struct PlanKey {
  std::string key, allowed, meaning;
};
std::vector<PlanKey> plan_keys();         ///< for `--set help`
std::vector<std::string> plan_methods();  ///< what plan.method may be

}  // namespace lumigraft::relight
