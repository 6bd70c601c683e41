#pragma once
// Extrapolation of later bounces of light between real surfaces.
#include <vector>

#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// Each round of gathering adds a bounce. Later bounces are similar, each a constant fraction of the previous one: in
/// every third round the sum of their geometric series is applied at once (Aitken 1926).
class BounceSeries {
 public:
  /// Call before a round; `irradiance`: of all cells.
  void begin(const std::vector<Rgb>& irradiance) { before_ = irradiance; }
  /// Call after it. False if no further round is needed: at least `min_rounds` rounds ran and the last bounce was
  /// negligible, or the maximum number of rounds is reached.
  bool goes_on(std::vector<Rgb>& irradiance, int min_rounds);
  int round() const { return round_; }  ///< the next round, from 1

 private:
  std::vector<Rgb> before_;
  int round_ = 1;
  float last_ = 0;  ///< contribution of the last round
};

}  // namespace lumigraft::relight
