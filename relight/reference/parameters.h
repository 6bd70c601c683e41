#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.

namespace lumigraft::relight {
inline constexpr struct ReferenceParameters {
  int per_pilot = 8, min_pilot = 4, near_px = 4;  ///< samples per pilot sample; averaged noise, poor for one pixel
  int max_fall = 8;                               ///< minimum count: the mean divided by this
  float max_rise = 32;                            ///< maximum count: the mean times this
  double object_weight = 0.25;                    ///< of noise on objects, which the object's own radiance masks
  int photons = 1 << 17;                          ///< from lamps to transmissive objects
  int sure_bounces = 3, aimed_bounces = 2;        ///< no Russian roulette; sampled towards regions of changed light too
  /// Maximum survival probability of Russian roulette. Throughput below which a branch is subject to it; the same for
  /// one that has hit an object, where the change originates.
  float max_survival = 0.95f, sure_on = 0.5f, sure_split = 0.05f;
} kPaths;
}  // namespace lumigraft::relight
