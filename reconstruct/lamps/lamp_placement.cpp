#include "reconstruct/lamps/lamp_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/lamps/distant_lamps.h"
#include "reconstruct/lamps/lamp_refinement.h"
#include "reconstruct/lamps/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Search& kSearch = kLampParameters.search;

std::vector<double> spaced(double low, double high, int count) {
  std::vector<double> result;
  for (int i = 0; i < count; ++i) result.push_back(low + (high - low) * i / (count - 1));
  return result;
}

std::vector<SamplePair> thinned(const std::vector<SamplePair>& pairs) {
  std::vector<SamplePair> result;
  for (std::size_t i = 0; i < pairs.size(); i += kSearch.pair_stride) result.push_back(pairs[i]);
  return result;
}

/// A sample of known albedo counts as all pairs that it would be part of, each of which has the errors of two samples.
void add_known_albedo(const std::vector<SurfaceSample>& samples, std::vector<SamplePair>& pairs) {
  constexpr const LampParameters::Pairs& kPairs = kLampParameters.pairs;
  const float error = kPairs.sample_error * kPairs.sample_error;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const SampleAlbedo& known = samples[i].known;
    if (!samples[i].usable || known.sigma < 0) continue;
    const float relative = known.sigma / std::max(known.albedo.mean(), kPairs.min_albedo);
    const float weight = (kPairs.neighbours + kPairs.far) * 2 * error / (error + relative * relative);
    pairs.push_back({static_cast<int>(i), static_cast<int>(samples.size() + i), weight});
  }
}

double outline_penalty(const PointLight& light, bool flat) {
  return (light.squareness > kSearch.quadrilateral && !flat) || (light.squareness < kSearch.round && flat)
             ? 1 + kSearch.outline_penalty
             : 1;
}

class LampSearch {
 public:
  LampSearch(ShadingModel& model, const std::vector<SamplePair>& pairs, int paper)
      : model_(model),
        pairs_(pairs),
        some_pairs_(thinned(pairs)),
        paper_(paper),
        shapes_(model.lamps()),
        powers_(model.lamps()),
        facing_(model.lamps()),
        factors_(model.lamps()) {}

  /// Without earlier estimates.
  LampSolution solve(const Eigen::Vector3f& probe, Search search) {
    start(probe);
    if (has_clipped(model_)) {
      start_gains();
      adopt(refine_lamps(model_, some_pairs_, paper_, shapes_, Search::rough));
    }
    for (int round = 0; round < kSearch.rounds; ++round) {
      bool changed = false;
      for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) changed |= descend(lamp);
      if (!changed) break;
    }
    const Refinement refined = refine_shapes();
    return search == Search::rough ? solution(refined) : finish();
  }

  /// From earlier estimates; empty if a lamp moved out of the range searched around them.
  std::optional<LampSolution> solve_near(const std::vector<std::optional<LampEstimate>>& before) {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) start_at(lamp, *before[lamp]);
    LampSolution found = finish();
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (model_.placed(lamp) || found.lamps[lamp].far) continue;
      const double moved = std::log(found.lamps[lamp].distance_m / before[lamp]->distance_m);
      if (std::abs(moved) > kSearch.fine_limit * kSearch.fine_reach) return std::nullopt;
    }
    return found;
  }

  std::vector<LampEstimate> follow(const std::vector<LampEstimate>& before, const std::vector<bool>& changed) {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      LampShape& shape = shapes_[lamp];
      start_at(lamp, before[lamp]);
      shape.held = !changed[lamp];
      shape.far = before[lamp].far;
      if (shape.far) shape.log_distance = std::log(kLampParameters.distant_m[2]);
      if (shape.held || shape.far) model_.tabulate(lamp, {shape.log_distance}, kSearch.fine_rays);
    }
    Refinement refined;
    for (int round = 0; round < kSearch.follow_rounds; ++round) {
      for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp)
        if (!shapes_[lamp].held && !shapes_[lamp].far) tabulate_near(lamp);
      refined = refine_lamps(model_, pairs_, paper_, shapes_, Search::fine);
      bool inside = true;
      for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp)
        inside &= std::abs(refined.shapes[lamp].log_distance - shapes_[lamp].log_distance) <
                  kSearch.fine_limit * kSearch.fine_reach;
      shapes_ = refined.shapes;
      if (inside) break;
    }
    std::vector<LampEstimate> result = solution(refined).lamps;
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (!changed[lamp]) result[lamp] = before[lamp];
      if (before[lamp].far) result[lamp].distance_m = before[lamp].distance_m;
    }
    return result;
  }

 private:
  void start_at(std::size_t lamp, const LampEstimate& before) {
    LampShape& shape = shapes_[lamp];
    shape = {.log_distance = std::log(before.distance_m), .flat = before.flat, .beam = before.beam};
    if (model_.placed(lamp)) set_from_tag(lamp);
    if (shape.flat) shape.tilt = model_.tilt_of(lamp, before.normal);
    // At zero power the gradient vanishes: a lamp that was switched on would not be found.
    const double min_gain = unseen(lamp) ? kLampParameters.refinement.log_dim : 0;
    for (std::size_t c = 0; clipped(lamp) && c < 3; ++c)
      shape.log_gain[c] = std::max<double>(min_gain, std::log(before.gain[static_cast<Eigen::Index>(c)]));
  }

  /// Lamps at the usual distance; a panel faces the probe, the floor or the tag.
  void start(const Eigen::Vector3f& probe) {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (model_.placed(lamp))
        model_.tabulate(lamp, {model_.log_distance_of(model_.light(lamp))}, 1);
      else
        model_.tabulate(
            lamp, spaced(std::log(kSearch.min_distance_m), std::log(kSearch.max_distance_m), kSearch.grid_steps), 1);
      const Eigen::Vector3f& direction = model_.light(lamp).direction;
      facing_[lamp] = {-direction};
      if (direction.z() > kSearch.facing_cosine) facing_[lamp].push_back(-Eigen::Vector3f::UnitZ());
      const Eigen::Vector3f to_tag =
          -(probe + static_cast<float>(kLampParameters.usual_distance_m) * direction).normalized();
      if (to_tag.dot(direction) < -kSearch.facing_cosine) facing_[lamp].push_back(to_tag);
      LampShape& shape = shapes_[lamp];
      shape = {};
      shape.log_distance = std::log(kLampParameters.usual_distance_m);
      shape.flat = model_.light(lamp).squareness > kSearch.quadrilateral;
      if (shape.flat) shape.tilt = model_.tilt_of(lamp, facing_[lamp].back());
      if (model_.placed(lamp)) set_from_tag(lamp);
      update(lamp);
    }
  }

  /// Position and normal of a lamp with a tag.
  void set_from_tag(std::size_t lamp) {
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
    const std::vector<std::optional<LampShape>> far =
        find_distant_lamps(model_, pairs_, near.shapes, near.pair_variance);
    if (std::none_of(far.begin(), far.end(), [](const auto& shape) { return shape.has_value(); }))
      return solution(near);
    shapes_ = near.shapes;
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (far[lamp]) {
        shapes_[lamp] = *far[lamp];
        model_.tabulate(lamp, {shapes_[lamp].log_distance}, kSearch.fine_rays);
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
      model_.tabulate(lamp, {at}, kSearch.fine_rays);
    else
      model_.tabulate(lamp, spaced(at - kSearch.fine_reach, at + kSearch.fine_reach, kSearch.fine_steps),
                      kSearch.fine_rays);
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
      if (shape.beam) estimate.log_sigma = std::hypot(estimate.log_sigma, kSearch.beam_log_sigma);
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
  bool unseen(std::size_t lamp) const { return model_.light(lamp).visibility != PointLight::Visibility::visible; }
  void set_gain(std::size_t lamp, double log_gain) {
    shapes_[lamp].log_gain = {log_gain, log_gain, log_gain};
    update(lamp);
  }

  void adopt(const Refinement& refinement) {
    shapes_ = refinement.shapes;
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) update(lamp);
  }

  /// Gains of clipped lamps at the usual distance: first the best one for all, then one by one. Without them a single
  /// lamp close to the probe would have to explain the effect of all. Lamps that the fish-eye does not see start
  /// switched off, so that they do not explain the effect of a visible one.
  void start_gains() {
    std::vector<std::size_t> all;
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (clipped(lamp) && !unseen(lamp)) all.push_back(lamp);
    }
    scan_gain(all);
    for (int round = 0; round < kSearch.rounds; ++round) {
      for (const std::size_t lamp : all) scan_gain({lamp});
    }
  }

  void scan_gain(const std::vector<std::size_t>& lamps) {
    double min_cost = std::numeric_limits<double>::infinity(), best = 0;
    for (const double log_gain : spaced(0, std::log(kSearch.max_gain), kSearch.gain_steps)) {
      for (const std::size_t lamp : lamps) set_gain(lamp, log_gain);
      const double here = cost();
      if (here >= min_cost) continue;
      min_cost = here;
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
    return cost_of_albedo();
  }
  double cost_of_albedo() const {
    double sum = robust_cost(log_albedo_, some_pairs_) * static_cast<double>(pairs_.size()) /
                 static_cast<double>(some_pairs_.size());
    if (needs_albedo_scale_prior(model_, paper_)) sum += albedo_scale_cost(model_, log_albedo_, paper_);
    return sum * penalty(shapes_);
  }

  /// The best of all distances and simple shapes of one lamp, with the others fixed.
  bool descend(std::size_t lamp) {
    const LampShape before = shapes_[lamp];
    LampShape best = before;
    double min_cost = cost();
    const double octave = std::log(2.0);
    const std::vector<double> gains = unseen(lamp)    ? spaced(0, std::log(kSearch.max_gain), kSearch.gain_steps)
                                      : clipped(lamp) ? spaced(-2 * octave, 2 * octave, kSearch.near_gain_steps)
                                                      : std::vector{0.0};
    const std::vector<Eigen::Array3f> others = model_.irradiance(powers_, factors_, static_cast<int>(lamp));
    const auto consider = [&](const LampShape& shape) {
      shapes_[lamp] = shape;
      model_.factors(lamp, shape, factors_[lamp]);
      for (const double gain : gains) {
        std::array<double, 3> log_gain = before.log_gain;
        for (double& g : log_gain) g = unseen(lamp) ? gain : std::max(0.0, g + gain);
        if (gain != gains.front() && log_gain == shapes_[lamp].log_gain) continue;  // both at the lower bound
        shapes_[lamp].log_gain = log_gain;
        model_.log_albedo(others, model_.power(lamp, shapes_[lamp]), factors_[lamp], log_albedo_);
        const double here = cost_of_albedo();
        if (here >= min_cost) continue;
        min_cost = here;
        best = shapes_[lamp];
      }
    };
    for (const double log_distance : model_.tabulated(lamp)) {
      if (shape_known(lamp)) {
        consider({log_distance, true, before.tilt});
        continue;
      }
      consider({log_distance, false, {}});
      if (before.flat) consider({log_distance, true, before.tilt});
      for (const Eigen::Vector3f& normal : facing_[lamp]) consider({log_distance, true, model_.tilt_of(lamp, normal)});
    }
    shapes_[lamp] = best;
    update(lamp);
    return best.log_distance != before.log_distance || best.flat != before.flat || best.tilt != before.tilt ||
           best.log_gain != before.log_gain;
  }

  /// Refines all lamps together, then tries each lamp that the fish-eye does not see switched off, and each of the
  /// strongest with a doubtful outline in the other shape.
  Refinement refine_shapes() {
    Refinement best = refine_lamps(model_, some_pairs_, paper_, shapes_, Search::rough);
    double min_cost = best.cost * penalty(best.shapes);
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (!unseen(lamp)) continue;
      std::vector<LampShape> other = best.shapes;
      other[lamp].log_gain = {};
      const Refinement tried = refine_lamps(model_, some_pairs_, paper_, other, Search::rough);
      if (tried.cost * penalty(tried.shapes) > min_cost) continue;
      best = tried;
      min_cost = tried.cost * penalty(tried.shapes);
    }
    for (std::size_t lamp = 0; lamp < std::min<std::size_t>(kSearch.shaped, model_.lamps()); ++lamp) {
      const float squareness = model_.light(lamp).squareness;
      if (squareness < kSearch.round || squareness > kSearch.quadrilateral || shape_known(lamp)) continue;
      std::vector<LampShape> other = best.shapes;
      other[lamp].flat = !other[lamp].flat;
      other[lamp].tilt = {};
      const Refinement tried = refine_lamps(model_, some_pairs_, paper_, other, Search::rough);
      if (tried.cost * penalty(tried.shapes) < min_cost) {
        best = tried;
        min_cost = tried.cost * penalty(tried.shapes);
      }
    }
    try_beams(best, min_cost);
    adopt(best);
    return best;
  }

  /// A lamp deep in a shade lights a patch, as a near isotropic lamp does. It is taken for a beam where that explains
  /// the room much better.
  void try_beams(Refinement& best, double min_cost) const {
    for (std::size_t lamp = 0; lamp < std::min<std::size_t>(kSearch.shaped, model_.lamps()); ++lamp) {
      // Beyond the grid a lamp counts as distant: no beam.
      if (model_.placed(lamp) || best.shapes[lamp].log_distance > std::log(kSearch.max_distance_m)) continue;
      std::vector<LampShape> other = best.shapes;
      if (!other[lamp].flat) other[lamp].tilt = {};
      other[lamp].flat = other[lamp].beam = true;
      other[lamp].log_distance += kSearch.beam_farther;
      const Refinement tried = refine_lamps(model_, some_pairs_, paper_, other, Search::rough);
      const double cost = tried.cost * penalty(tried.shapes);
      if (cost > kSearch.max_beam_cost * min_cost ||
          min_cost - cost < kSearch.min_beam_gain * static_cast<double>(some_pairs_.size()))
        continue;
      best = tried;
      min_cost = cost;
    }
  }

  ShadingModel& model_;
  const std::vector<SamplePair>& pairs_;
  std::vector<SamplePair> some_pairs_;  ///< for the search
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
  std::vector<SamplePair> pairs = choose_pairs(samples);
  if (paper) {
    samples.push_back(*paper);
    gathered.push_back(room.gather(paper->position, paper->normal, kSearch.paper_rays).irradiance);
  }
  ShadingModel model(room, illumination, samples, gathered);
  const int paper_index = paper ? static_cast<int>(samples.size()) - 1 : -1;
  add_known_albedo(samples, pairs);
  LampSearch search(model, pairs, paper_index);
  const bool all_known = before.size() == illumination.lights.size() &&
                         std::all_of(before.begin(), before.end(), [](const auto& lamp) { return lamp.has_value(); });
  if (all_known) {
    if (auto found = search.solve_near(before)) return *std::move(found);
  }
  return search.solve(illumination.probe_position_m, how);
}

std::vector<LampEstimate> follow_lamps(const IrradianceModel& room, const Illumination& illumination,
                                       const std::vector<SurfaceSample>& samples,
                                       const std::vector<Eigen::Vector3f>& gathered,
                                       const std::vector<LampEstimate>& before, const std::vector<bool>& changed) {
  std::vector<SamplePair> pairs;
  add_known_albedo(samples, pairs);
  ShadingModel model(room, illumination, samples, gathered);
  return LampSearch(model, pairs, -1).follow(before, changed);
}

}  // namespace lumigraft::reconstruct
