#pragma once
// The rendering settings that relight chose for a frame: a plain value that can be printed, recorded and set by the
// user (plan.KEY).
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "capture/session/config.h"

namespace lumigraft::relight {

struct Quality;

struct Plan {
  /// How the change of light reaches real surfaces: "dvct": cone tracing; "dlpv": propagation from cell to cell;
  /// "rays": final gathering on the CPU. "reference": path tracing, which reads only `samples` of the plan.
  std::string method = "dvct";
  int volume = 64;  ///< voxels along the edge of each cascade: 32, 64, 128 or 256
  /// Indirect light is traced at 1/trace_scale of the image size: 1, 2 or 4. 4 is the live setting, which requires
  /// cells = 1; 8 and 16 are live settings of rays, with which
  /// real surfaces, too, are traced at a half or a quarter of that size.
  int trace_scale = 2;
  int cells = 0;        ///< 1: indirect light is gathered in cells of the volumes, in rounds of frames; 0: per pixel
  int rsm = 256;        ///< edge of the reflective shadow maps, texels
  int max_lights = 32;  ///< number of lamps rendered as lamps, strongest first; at most shader::kMaxLamps
  int sh_bands = 3;     ///< bands of spherical harmonics for unoccluded light other than the lamps: 1, 2 or 3
  int bounces = 2;      ///< indirect bounces of the change; the thesis uses 1
  int lpv_steps = 16;   ///< dlpv: propagation steps of one cell each (two voxels for volumes up to 128)
  int rays = 20;        ///< rays: per probe on an object, or per gathered pixel
  int samples = 64;     ///< reference only: camera paths per pixel
  /// "camera": objects have the camera's noise and sharpness, darkened and brightened surfaces its noise; "plain": the
  /// exact change of light is added to the frame.
  std::string look = "plain";
  /// Time that a picture may take, ms of wall time; 0: any. Rays choose trace_scale and rays by it (quality_ladder.h).
  int budget_ms = 0;
  int adaptive = 1;                ///< 1: values not set by the user follow measures of the scene (planner.h); 0: fixed
  std::set<std::string> user_set;  ///< keys set by the user; never changed automatically
  /// Replaces the result of quality_of(); no configuration key sets it. Benchmarks use it to render with other
  /// settings.
  std::shared_ptr<const Quality> quality;

  /// Whether the method renders on a GPU device, with the plan's lamps, bands and maps; the others use the full
  /// illumination.
  bool on_device() const { return method != "reference" && method != "rays"; }
  bool in_cells() const { return (method == "dvct" || method == "dlpv") && (cells == 1 || trace_scale == 4); }
};

/// The plan of rays that takes the place of a live plan of cones; other keys that both read are kept.
Plan by_rays(Plan cones);

/// Reads the optional table [plan] over `defaults`, and records which keys it sets; the caller calls root.finish().
Plan read_plan(const capture::ConfigTable& root, const Plan& defaults);

struct PlanKey {
  std::string key, allowed, meaning;
};
std::vector<PlanKey> plan_keys();         ///< for `--set help`
std::vector<std::string> plan_methods();  ///< allowed values of plan.method
std::vector<std::string> plan_looks();    ///< allowed values of plan.look

}  // namespace lumigraft::relight
