#include "reconstruct/lamps/distant_lamps.h"

#include <cmath>
#include <limits>

#include "reconstruct/lamps/lamp_refinement.h"

namespace lumigraft::reconstruct {
namespace {

constexpr double kAsFar_m[] = {12, 24, 100};  ///< as good as infinitely far, and what explains the room as the sun does

/// The room's lamps, each where it was found or far.
class Arrangement {
 public:
  Arrangement(const ShadingModel& model, const std::vector<SamplePair>& pairs, const std::vector<LampShape>& shapes)
      : model_(model), pairs_(pairs), factors_(shapes.size()) {
    for (std::size_t lamp = 0; lamp < shapes.size(); ++lamp) {
      powers_.push_back(model.power(lamp, shapes[lamp]));
      model.factors(lamp, shapes[lamp], factors_[lamp]);
    }
  }

  /// Puts other factors in the place of a lamp's.
  void exchange(std::size_t lamp, std::vector<float>& factors) { std::swap(factors_[lamp], factors); }

  double cost() {
    model_.log_albedo(powers_, factors_, log_albedo_);
    return robust_cost(log_albedo_, pairs_, 1);
  }

 private:
  const ShadingModel& model_;
  const std::vector<SamplePair>& pairs_;
  std::vector<Eigen::Array3f> powers_;
  std::vector<std::vector<float>> factors_;
  std::vector<Eigen::Array3f> log_albedo_;
};

struct DistantLamp {
  std::size_t lamp;
  LampShape shape;
  double cost;                 ///< with this one alone far
  std::vector<float> factors;  ///< of the state that the arrangement is not in
};

DistantLamp best_far(ShadingModel& model, Arrangement& lamps, std::size_t lamp, const LampShape& near) {
  DistantLamp best{lamp, {}, std::numeric_limits<double>::infinity(), {}};
  for (const double distance_m : kAsFar_m) {
    const LampShape shape{.log_distance = std::log(distance_m), .log_gain = near.log_gain, .far = true};
    std::vector<float> factors;
    model.tabulate(lamp, {shape.log_distance}, kFineRays);
    model.factors(lamp, shape, factors);
    lamps.exchange(lamp, factors);
    const double cost = lamps.cost();
    lamps.exchange(lamp, factors);
    if (cost < best.cost) best = {lamp, shape, cost, std::move(factors)};
  }
  return best;
}

}  // namespace

std::vector<std::optional<LampShape>> far_lamps(ShadingModel& model, const std::vector<SamplePair>& pairs,
                                                const std::vector<LampShape>& near, double pair_variance) {
  Arrangement lamps(model, pairs, near);
  const double found = lamps.cost();
  std::vector<DistantLamp> doubtful;
  for (std::size_t lamp = 0; lamp < near.size(); ++lamp) {
    if (model.placed(lamp)) continue;
    DistantLamp far = best_far(model, lamps, lamp, near[lamp]);
    if (far.cost < found + pair_variance) doubtful.push_back(std::move(far));
  }
  std::vector<std::optional<LampShape>> result(near.size());
  for (DistantLamp& far : doubtful) {
    lamps.exchange(far.lamp, far.factors);
    if (lamps.cost() <= found)
      result[far.lamp] = far.shape;
    else
      lamps.exchange(far.lamp, far.factors);
  }
  for (DistantLamp& far : doubtful)
    if (!result[far.lamp]) lamps.exchange(far.lamp, far.factors);
  if (lamps.cost() < found + pair_variance)
    for (const DistantLamp& far : doubtful) result[far.lamp] = far.shape;
  return result;
}

}  // namespace lumigraft::reconstruct
