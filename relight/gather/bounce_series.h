#pragma once
// Later bounces of light between real surfaces.
#include <vector>

#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// Each round of gathering is one more bounce. Later ones look alike, each a share of the last: every third time their
/// sum, a geometric series, is taken at once (Aitken 1926).
class BounceSeries {
 public:
  /// Before a round; `irradiance`: of all cells.
  void begin(const std::vector<Rgb>& irradiance) { before_ = irradiance; }
  /// After it. False where no more is needed: the last bounce brought next to nothing, and there were `least_rounds`,
  /// or there were very many.
  bool goes_on(std::vector<Rgb>& irradiance, int least_rounds);
  int round() const { return round_; }  ///< that begins next, from 1

 private:
  std::vector<Rgb> before_;
  int round_ = 1;
  float last_ = 0;  ///< what the last round brought
};

}  // namespace lumigraft::relight
