#pragma once
// Where lamps stand and how they emit, from how the room is shaded.
//
// The fish-eye gives a lamp's direction and its irradiance at the probe; the lamp then stands at probe + d · direction
// with intensity irradiance · d². Surfaces of equal albedo must shade alike: for a pair of samples the difference of
// log B - log E must vanish. d, and for a lamp that is a panel its normal, minimise the robust (Geman-McClure) sum of
// these differences over many pairs: shading falls off with distance, shadows move with it.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/lamps/shading_model.h"
#include "reconstruct/light/light.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

struct LampEstimate {
  float distance_m = kInfinitelyFar;
  float log_sigma = 0;  ///< 1σ of log distance; large where the shading says nothing
  bool far = false;     ///< infinitely far explains the room as well; distance_m is then the best of those near by
  bool flat = false;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< where flat
  bool beam = false;                                 ///< and flat: it stands deep in a shade, or has a lens
  Eigen::Vector3f gain = Eigen::Vector3f::Ones();    ///< true over measured irradiance; 1 where not clipped
  float gain_log_sigma = 0;                          ///< 1σ of log gain, its channels together
};

struct LampSolution {
  std::vector<LampEstimate> lamps;
  Eigen::MatrixXd covariance;  ///< of LampShape, kPerLamp numbers for each lamp
};

/// `gathered` is IrradianceModel::gather of each sample. One estimate per lamp of the illumination. Where `before`
/// holds an earlier estimate of every lamp the search starts there, and starts afresh only when it ends elsewhere.
///
/// A clipped lamp's irradiance is a lower bound: its gain, per channel, is unknown too. It follows from the contrast
/// between what the lamp lights and what it does not, against the rest of the light, which was measured; from `paper`,
/// a sample that is white paper of known albedo; and where there is none, loosely, from what rooms usually are made of.
LampSolution locate_lamps(const IrradianceModel& room, const Illumination& illumination,
                          std::vector<SurfaceSample> samples, std::vector<Eigen::Vector3f> gathered,
                          const std::optional<SurfaceSample>& paper,
                          const std::vector<std::optional<LampEstimate>>& before, Search how = Search::fine);

}  // namespace lumigraft::reconstruct
