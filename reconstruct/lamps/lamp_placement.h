#pragma once
// Position and emission of lamps from the shading of the room.
//
// The fish-eye gives a lamp's direction and its irradiance at the probe; the lamp is then at probe + d · direction with
// intensity irradiance · d². Surfaces of equal albedo must shade alike: for a pair of samples the difference of
// log B - log E must vanish. This searches the inverse distance 1/d and the normal of a panel that are most probable
// (lamp_posterior.h): shading falls off with distance, and shadows move with the lamp.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "reconstruct/lamps/lamp_memory.h"
#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/lamps/shading_model.h"
#include "reconstruct/light/light.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

struct LampEstimate {
  float distance_m = kInfinitelyFar;
  float log_sigma = 0;  ///< 1σ of log distance; large if shading does not determine it
  bool far = false;     ///< an infinite distance fits as well; distance_m is then the best finite one
  bool flat = false;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< if flat
  bool beam = false;                                 ///< then also flat: cosine⁴ emission, of a deep shade or a lens
  Eigen::Vector3f gain = Eigen::Vector3f::Ones();    ///< true over measured irradiance; 1 where not clipped
  float gain_log_sigma = 0;                          ///< 1σ of log gain, of all channels
};

/// `gathered`: IrradianceModel::gather of each sample. Returns one estimate per lamp of the illumination. If `before`
/// has an earlier estimate of every lamp the search starts there, and starts afresh only if it ends far from it.
///
/// The irradiance of a clipped lamp is a lower bound, so its gain per channel is unknown too. It follows from the
/// contrast between surface that the lamp lights and surface that only the other, measured light reaches; from `paper`,
/// a sample of white paper; and without it, loosely, from the typical albedo of rooms.
///
/// `memory`: of earlier fine solutions; gets this one.
std::vector<LampEstimate> locate_lamps(const IrradianceModel& room, const Illumination& illumination,
                                       const std::vector<SurfaceSample>& samples,
                                       const std::vector<Eigen::Vector3f>& gathered,
                                       const std::optional<SurfaceSample>& paper,
                                       const std::vector<std::optional<LampEstimate>>& before, LampMemory& memory,
                                       Search how = Search::fine);

/// The light of now on surface of known albedo: searches only the lamps that `changed` since the estimates `before`,
/// from there, and holds the others. All samples have a known albedo.
std::vector<LampEstimate> follow_lamps(const IrradianceModel& room, const Illumination& illumination,
                                       const std::vector<SurfaceSample>& samples,
                                       const std::vector<Eigen::Vector3f>& gathered,
                                       const std::vector<LampEstimate>& before, const std::vector<bool>& changed,
                                       const LampMemory& memory);

}  // namespace lumigraft::reconstruct
