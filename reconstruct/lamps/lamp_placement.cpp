#include "reconstruct/lamps/lamp_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/lamps/distant_lamps.h"
#include "reconstruct/lamps/lamp_refinement.h"
#include "reconstruct/lamps/shading_model.h"

namespace lumigraft::reconstruct {
namespace {

constexpr double kNearest_m = 0.4, kFarthest_m = 8.0, kUsual_m = 1.5;
constexpr int kGridSteps = 16;
constexpr int kFineSteps = 7;
constexpr double kFineReach = 0.22;       ///< of log distance, either way
constexpr double kLargestGain = 1 << 18;  ///< the sun over a sky that is well exposed
constexpr int kGainSteps = 19;            ///< powers of two
constexpr int kPaperRays = 64;
constexpr int kRounds = 3;  ///< of coordinate descent
constexpr int kShaped = 3;  ///< strongest lamps whose shape is looked into after the grid
/// Outlines (PointLight::squareness) that are surely round, and surely have four corners. A shape that they speak
/// against costs this share of the robust sum.
constexpr float kRound = 0.1f, kQuadrilateral = 0.3f;
constexpr double kOutlinePenalty = 0.1;
/// A beam must bring the robust sum down to this share, where rooms without one come down by a hundredth at most; and
/// by so much for every pair: where all pairs agree the rest of the sum is nothing but the model's own error.
constexpr double kBeamShare = 0.95, kBeamPerPair = 0.03;
constexpr double kBeamFarther = 0.25;  ///< of log distance: one is looked for so far beyond what shines everywhere
constexpr float kBeamSigma = 0.2f;     ///< 1σ of log distance: narrower beams from farther away explain a room as well

std::vector<double> spaced(double low, double high, int count) {
  std::vector<double> result;
  for (int i = 0; i < count; ++i) result.push_back(low + (high - low) * i / (count - 1));
  return result;
}

std::vector<SamplePair> every_third(const std::vector<SamplePair>& pairs) {
  std::vector<SamplePair> result;
  for (std::size_t i = 0; i < pairs.size(); i += 3) result.push_back(pairs[i]);
  return result;
}

double outline_penalty(const PointLight& light, bool flat) {
  return (light.squareness > kQuadrilateral && !flat) || (light.squareness < kRound && flat) ? 1 + kOutlinePenalty : 1;
}

class LampSearch {
 public:
  LampSearch(ShadingModel& model, const std::vector<SamplePair>& pairs, int paper)
      : model_(model),
        pairs_(pairs),
        some_pairs_(every_third(pairs)),
        paper_(paper),
        shapes_(model.lamps()),
        powers_(model.lamps()),
        facing_(model.lamps()),
        factors_(model.lamps()) {}

  /// From nothing.
  LampSolution solve(const Eigen::Vector3f& probe, Search search) {
    start(probe);
    if (has_clipped(model_)) {
      start_gains();
      adopt(refine_lamps(model_, some_pairs_, paper_, shapes_, Search::rough));
    }
    for (int round = 0; round < kRounds; ++round) {
      bool changed = false;
      for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) changed |= descend(lamp);
      if (!changed) break;
    }
    const Refinement refined = refine_shapes();
    return search == Search::rough ? solution(refined) : finish();
  }

  /// From earlier estimates; empty where a lamp left what was looked at around its estimate.
  std::optional<LampSolution> solve_near(const std::vector<std::optional<LampEstimate>>& before) {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      LampShape& shape = shapes_[lamp];
      shape.log_distance = std::log(before[lamp]->distance_m);
      shape.flat = before[lamp]->flat;
      shape.beam = before[lamp]->beam;
      if (model_.placed(lamp)) place(lamp);
      if (shape.flat) shape.tilt = model_.tilt_of(lamp, before[lamp]->normal);
      // From nothing no slope leads to the power of a lamp that was switched on.
      const double least = unseen(lamp) ? kLogDim : 0;
      for (std::size_t c = 0; clipped(lamp) && c < 3; ++c) {
        shape.log_gain[c] = std::max<double>(least, std::log(before[lamp]->gain[static_cast<Eigen::Index>(c)]));
      }
    }
    LampSolution found = finish();
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (model_.placed(lamp)) continue;
      const double moved = std::log(found.lamps[lamp].distance_m / before[lamp]->distance_m);
      if (std::abs(moved) > 0.7 * kFineReach) return std::nullopt;
    }
    return found;
  }

 private:
  /// Lamps where they usually stand; a panel faces the probe, the floor, or the tag.
  void start(const Eigen::Vector3f& probe) {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (model_.placed(lamp))
        model_.tabulate(lamp, {model_.log_distance_of(model_.light(lamp))}, 1);
      else
        model_.tabulate(lamp, spaced(std::log(kNearest_m), std::log(kFarthest_m), kGridSteps), 1);
      const Eigen::Vector3f& direction = model_.light(lamp).direction;
      facing_[lamp] = {-direction};
      if (direction.z() > 0.3f) facing_[lamp].push_back(-Eigen::Vector3f::UnitZ());
      const Eigen::Vector3f to_tag = -(probe + static_cast<float>(kUsual_m) * direction).normalized();
      if (to_tag.dot(direction) < -0.3f) facing_[lamp].push_back(to_tag);
      LampShape& shape = shapes_[lamp];
      shape = {};
      shape.log_distance = std::log(kUsual_m);
      shape.flat = model_.light(lamp).squareness > kQuadrilateral;
      if (shape.flat) shape.tilt = model_.tilt_of(lamp, facing_[lamp].back());
      if (model_.placed(lamp)) place(lamp);
      update(lamp);
    }
  }

  /// Where and as its tag says.
  void place(std::size_t lamp) {
    const PointLight& light = model_.light(lamp);
    shapes_[lamp].log_distance = model_.log_distance_of(light);
    if (!light.flat) return;
    shapes_[lamp].flat = true;
    shapes_[lamp].tilt = model_.tilt_of(lamp, light.normal);
  }
  bool shape_known(std::size_t lamp) const { return model_.placed(lamp) && model_.light(lamp).flat; }

  /// The last refinement, on all pairs and with finer visibility.
  LampSolution finish() {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) tabulate_near(lamp);
    const Refinement near = refine_lamps(model_, pairs_, paper_, shapes_, Search::fine);
    const std::vector<std::optional<LampShape>> far = far_lamps(model_, pairs_, near.shapes, near.pair_variance);
    if (std::none_of(far.begin(), far.end(), [](const auto& shape) { return shape.has_value(); }))
      return solution(near);
    shapes_ = near.shapes;
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (far[lamp]) {
        shapes_[lamp] = *far[lamp];
        model_.tabulate(lamp, {shapes_[lamp].log_distance}, kFineRays);
      } else {
        tabulate_near(lamp);
      }
    }
    Refinement result = refine_lamps(model_, pairs_, paper_, shapes_, Search::fine);
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (far[lamp]) result.shapes[lamp].log_distance = near.shapes[lamp].log_distance;
    }
    return solution(result);
  }

  void tabulate_near(std::size_t lamp) {
    const double at = shapes_[lamp].log_distance;
    if (model_.placed(lamp))
      model_.tabulate(lamp, {at}, kFineRays);
    else
      model_.tabulate(lamp, spaced(at - kFineReach, at + kFineReach, kFineSteps), kFineRays);
  }

  LampSolution solution(const Refinement& last) const {
    LampSolution result{{}, last.covariance};
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      const LampShape& shape = last.shapes[lamp];
      LampEstimate estimate;
      estimate.distance_m = static_cast<float>(std::exp(shape.log_distance));
      estimate.log_sigma = static_cast<float>(last.log_sigma[lamp]);
      estimate.gain_log_sigma = clipped(lamp) ? static_cast<float>(last.gain_log_sigma[lamp]) : 0.0f;
      estimate.flat = shape.flat;
      estimate.beam = shape.beam;
      estimate.far = shape.far;
      if (shape.beam) estimate.log_sigma = std::hypot(estimate.log_sigma, kBeamSigma);
      if (shape.flat) estimate.normal = model_.normal(lamp, shape);
      for (std::size_t c = 0; c < 3; ++c) {
        estimate.gain[static_cast<Eigen::Index>(c)] = static_cast<float>(std::exp(shape.log_gain[c]));
      }
      result.lamps.push_back(estimate);
    }
    return result;
  }

  void update(std::size_t lamp) {
    model_.factors(lamp, shapes_[lamp], factors_[lamp]);
    powers_[lamp] = model_.power(lamp, shapes_[lamp]);
  }
  bool clipped(std::size_t lamp) const { return model_.light(lamp).clipped; }
  bool unseen(std::size_t lamp) const { return model_.light(lamp).shown != PointLight::Shown::yes; }
  void set_gain(std::size_t lamp, double log_gain) {
    shapes_[lamp].log_gain = {log_gain, log_gain, log_gain};
    update(lamp);
  }

  void adopt(const Refinement& refinement) {
    shapes_ = refinement.shapes;
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) update(lamp);
  }

  /// Gains of clipped lamps where they usually stand: first the best one for all, then one by one. Without them a
  /// single lamp close to the probe would have to explain what all of them do. Lamps that nobody sees are off at first:
  /// they may be, and do not explain what one that is seen does.
  void start_gains() {
    std::vector<std::size_t> all;
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (clipped(lamp) && !unseen(lamp)) all.push_back(lamp);
    }
    scan_gain(all);
    for (int round = 0; round < kRounds; ++round) {
      for (const std::size_t lamp : all) scan_gain({lamp});
    }
  }

  void scan_gain(const std::vector<std::size_t>& lamps) {
    double least = std::numeric_limits<double>::infinity(), best = 0;
    for (const double log_gain : spaced(0, std::log(kLargestGain), kGainSteps)) {
      for (const std::size_t lamp : lamps) set_gain(lamp, log_gain);
      const double here = cost();
      if (here >= least) continue;
      least = here;
      best = log_gain;
    }
    for (const std::size_t lamp : lamps) set_gain(lamp, best);
  }

  double penalty(const std::vector<LampShape>& shapes) const {
    double product = 1;
    for (std::size_t lamp = 0; lamp < shapes.size(); ++lamp) {
      product *= outline_penalty(model_.light(lamp), shapes[lamp].flat);
    }
    return product;
  }

  double cost() {
    model_.log_albedo(powers_, factors_, log_albedo_);
    double sum = robust_cost(log_albedo_, some_pairs_) * static_cast<double>(pairs_.size()) /
                 static_cast<double>(some_pairs_.size());
    if (has_gauge(model_, paper_)) sum += gauge_cost(model_, log_albedo_, paper_);
    return sum * penalty(shapes_);
  }

  /// The best of all distances and simple shapes of one lamp, the others held.
  bool descend(std::size_t lamp) {
    const LampShape before = shapes_[lamp];
    LampShape best = before;
    double least = cost();
    const auto consider = [&](const LampShape& shape) {
      shapes_[lamp] = shape;
      update(lamp);
      const double here = cost();
      if (here < least) {
        least = here;
        best = shape;
      }
    };
    const double octave = std::log(2.0);
    const std::vector<double> gains = unseen(lamp)    ? spaced(0, std::log(kLargestGain), kGainSteps)
                                      : clipped(lamp) ? spaced(-2 * octave, 2 * octave, 5)
                                                      : std::vector{0.0};
    for (const double gain : gains) {
      std::array<double, 3> log_gain = before.log_gain;
      for (double& g : log_gain) g = unseen(lamp) ? gain : std::max(0.0, g + gain);
      for (const double log_distance : model_.tabulated(lamp)) {
        if (shape_known(lamp)) {
          consider({log_distance, true, before.tilt, log_gain});
          continue;
        }
        consider({log_distance, false, {}, log_gain});
        if (before.flat) consider({log_distance, true, before.tilt, log_gain});
        for (const Eigen::Vector3f& normal : facing_[lamp]) {
          consider({log_distance, true, model_.tilt_of(lamp, normal), log_gain});
        }
      }
    }
    shapes_[lamp] = best;
    update(lamp);
    return best.log_distance != before.log_distance || best.flat != before.flat || best.tilt != before.tilt ||
           best.log_gain != before.log_gain;
  }

  /// Refines all lamps together, then looks whether one that nobody sees would rather be off, and one of the strongest,
  /// of doubtful outline, of the other kind.
  Refinement refine_shapes() {
    Refinement best = refine_lamps(model_, some_pairs_, paper_, shapes_, Search::rough);
    double least = best.cost * penalty(best.shapes);
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (!unseen(lamp)) continue;
      std::vector<LampShape> other = best.shapes;
      other[lamp].log_gain = {};
      const Refinement tried = refine_lamps(model_, some_pairs_, paper_, other, Search::rough);
      if (tried.cost * penalty(tried.shapes) > least) continue;
      best = tried;
      least = tried.cost * penalty(tried.shapes);
    }
    for (std::size_t lamp = 0; lamp < std::min<std::size_t>(kShaped, model_.lamps()); ++lamp) {
      const float squareness = model_.light(lamp).squareness;
      if (squareness < kRound || squareness > kQuadrilateral || shape_known(lamp)) continue;
      std::vector<LampShape> other = best.shapes;
      other[lamp].flat = !other[lamp].flat;
      other[lamp].tilt = {};
      const Refinement tried = refine_lamps(model_, some_pairs_, paper_, other, Search::rough);
      if (tried.cost * penalty(tried.shapes) < least) {
        best = tried;
        least = tried.cost * penalty(tried.shapes);
      }
    }
    try_beams(best, least);
    adopt(best);
    return best;
  }

  /// A lamp deep in a shade lights a patch, as one does that stands near and shines everywhere. It is taken for what it
  /// is where that explains the room much better.
  void try_beams(Refinement& best, double least) const {
    for (std::size_t lamp = 0; lamp < std::min<std::size_t>(kShaped, model_.lamps()); ++lamp) {
      // What is as good as infinitely far sends no beam.
      if (model_.placed(lamp) || best.shapes[lamp].log_distance > std::log(kFarthest_m)) continue;
      std::vector<LampShape> other = best.shapes;
      if (!other[lamp].flat) other[lamp].tilt = {};
      other[lamp].flat = other[lamp].beam = true;
      other[lamp].log_distance += kBeamFarther;
      const Refinement tried = refine_lamps(model_, some_pairs_, paper_, other, Search::rough);
      const double cost = tried.cost * penalty(tried.shapes);
      if (cost > kBeamShare * least || least - cost < kBeamPerPair * static_cast<double>(some_pairs_.size())) continue;
      best = tried;
      least = cost;
    }
  }

  ShadingModel& model_;
  const std::vector<SamplePair>& pairs_;
  std::vector<SamplePair> some_pairs_;  ///< enough to search with
  int paper_;                           ///< a sample's index, or -1
  std::vector<LampShape> shapes_;
  std::vector<Eigen::Array3f> powers_;
  std::vector<std::vector<Eigen::Vector3f>> facing_;
  std::vector<std::vector<float>> factors_;
  std::vector<Eigen::Array3f> log_albedo_;
};

}  // namespace

LampSolution locate_lamps(const IrradianceModel& room, const Illumination& illumination,
                          std::vector<SurfaceSample> samples, std::vector<Eigen::Vector3f> gathered,
                          const std::optional<SurfaceSample>& paper,
                          const std::vector<std::optional<LampEstimate>>& before, Search how) {
  if (illumination.lights.empty()) return {};
  const std::vector<SamplePair> pairs = choose_pairs(samples);
  if (paper) {
    samples.push_back(*paper);
    gathered.push_back(room.gather(paper->position, paper->normal, kPaperRays).irradiance);
  }
  ShadingModel model(room, illumination, samples, gathered);
  const int paper_index = paper ? static_cast<int>(samples.size()) - 1 : -1;
  LampSearch search(model, pairs, paper_index);
  const bool all_known = before.size() == illumination.lights.size() &&
                         std::all_of(before.begin(), before.end(), [](const auto& lamp) { return lamp.has_value(); });
  if (all_known) {
    if (auto found = search.solve_near(before)) return *std::move(found);
  }
  return search.solve(illumination.probe_position_m, how);
}

}  // namespace lumigraft::reconstruct
