#include "reconstruct/lamps/distant_lamps.h"

#include <cmath>
#include <limits>

#include "reconstruct/lamps/lamp_refinement.h"
#include "reconstruct/lamps/parameters.h"

namespace lumigraft::reconstruct {
namespace {

/// The lamps of the room, each near or distant.
class LampArrangement {
 public:
  LampArrangement(const ShadingModel& model, const std::vector<SamplePair>& pairs, const std::vector<LampShape>& shapes)
      : model_(model), pairs_(pairs), factors_(shapes.size()) {
    for (std::size_t lamp = 0; lamp < shapes.size(); ++lamp) {
      powers_.push_back(model.power(lamp, shapes[lamp]));
      model.factors(lamp, shapes[lamp], factors_[lamp]);
    }
  }

  /// Swaps the irradiance factors of one lamp.
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
  double cost;                 ///< with this lamp alone distant
  std::vector<float> factors;  ///< of the lamp's other state
};

DistantLamp best_far(ShadingModel& model, LampArrangement& lamps, std::size_t lamp, const LampShape& near) {
  DistantLamp best{lamp, {}, std::numeric_limits<double>::infinity(), {}};
  for (const double distance_m : kLampParameters.distant_m) {
    const LampShape shape{.log_distance = std::log(distance_m), .log_gain = near.log_gain, .far = true};
    std::vector<float> factors;
    model.tabulate(lamp, {shape.log_distance}, kLampParameters.search.fine_rays);
    model.factors(lamp, shape, factors);
    lamps.exchange(lamp, factors);
    const double cost = lamps.cost();
    lamps.exchange(lamp, factors);
    if (cost < best.cost) best = {lamp, shape, cost, std::move(factors)};
  }
  return best;
}

}  // namespace

std::vector<std::optional<LampShape>> find_distant_lamps(ShadingModel& model, const std::vector<SamplePair>& pairs,
                                                         const std::vector<LampShape>& near, double pair_variance) {
  LampArrangement lamps(model, pairs, near);
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
