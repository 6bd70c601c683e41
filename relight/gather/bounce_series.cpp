#include "relight/gather/bounce_series.h"

#include "relight/gather/parameters.h"

namespace lumigraft::relight {
bool BounceSeries::goes_on(std::vector<Rgb>& irradiance, int min_rounds) {
  // Sums of absolute values over all cells and channels: after the round, and of the round's contribution.
  float all = 0, brought = 0;
  for (std::size_t i = 0; i < irradiance.size(); ++i) {
    all += irradiance[i].abs().sum();
    brought += (irradiance[i] - before_[i]).abs().sum();
  }
  if (round_ >= min_rounds && brought <= kGather.settled * all) return false;
  const float ratio = last_ > 0 ? brought / last_ : 1;
  if (round_ % 3 == 0 && ratio < kGather.max_bounce_ratio) {
    for (std::size_t i = 0; i < before_.size(); ++i)
      irradiance[i] += ratio / (1 - ratio) * (irradiance[i] - before_[i]);
  }
  last_ = brought;
  return ++round_ <= kGather.max_bounces;
}

}  // namespace lumigraft::relight
