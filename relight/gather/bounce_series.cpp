#include "relight/gather/bounce_series.h"

namespace lumigraft::relight {
namespace {

constexpr int kMostRounds = 12;
constexpr float kSettled = 0.003f;   // share of the change that one more bounce brings
constexpr float kMostShare = 0.95f;  // of a bounce that comes back with the next, where there is a sum to take

}  // namespace

bool BounceSeries::goes_on(std::vector<Rgb>& irradiance, int least_rounds) {
  // Over all cells and colours, without signs: what they hold after the round, and what it brought.
  float all = 0, brought = 0;
  for (std::size_t i = 0; i < irradiance.size(); ++i) {
    all += irradiance[i].abs().sum();
    brought += (irradiance[i] - before_[i]).abs().sum();
  }
  if (round_ >= least_rounds && brought <= kSettled * all) return false;
  const float share = last_ > 0 ? brought / last_ : 1;
  if (round_ % 3 == 0 && share < kMostShare) {
    for (std::size_t i = 0; i < before_.size(); ++i)
      irradiance[i] += share / (1 - share) * (irradiance[i] - before_[i]);
  }
  last_ = brought;
  return ++round_ <= kMostRounds;
}

}  // namespace lumigraft::relight
