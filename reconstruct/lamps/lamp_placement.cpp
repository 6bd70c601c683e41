#include "reconstruct/lamps/lamp_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "reconstruct/lamps/lamp_posterior.h"
#include "reconstruct/lamps/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Search& kSearch = kLampParameters.search;

std::vector<double> spaced(double low, double high, int count) {
  std::vector<double> result;
  for (int i = 0; i < count; ++i) result.push_back(low + (high - low) * i / (count - 1));
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

/// Every `stride`-th sample, the paper after them, and their pairs.
struct Evidence {
  std::vector<SurfaceSample> samples;
  std::vector<Eigen::Vector3f> gathered;
  std::vector<SamplePair> pairs;
  int paper = -1;  ///< a sample's index, or -1

  Evidence(const std::vector<SurfaceSample>& all, const std::vector<Eigen::Vector3f>& all_gathered,
           std::size_t stride) {
    for (std::size_t i = 0; i < all.size(); i += stride) {
      samples.push_back(all[i]);
      gathered.push_back(all_gathered[i]);
    }
    pairs = choose_pairs(samples);
    for (SamplePair& pair : pairs) pair.weight = static_cast<float>(stride);  // it represents so many of all
  }
  void add_paper(const SurfaceSample& white, const Eigen::Vector3f& light) {
    paper = static_cast<int>(samples.size());
    samples.push_back(white);
    gathered.push_back(light);
  }
};

double total_weight(const std::vector<SamplePair>& pairs) {
  return std::accumulate(pairs.begin(), pairs.end(), 0.0,
                         [](double sum, const SamplePair& p) { return sum + p.weight; });
}

class LampSearch {
 public:
  LampSearch(const IrradianceModel& room, const Illumination& illumination, Evidence evidence)
      : evidence_(std::move(evidence)),
        model_(room, illumination, evidence_.samples, evidence_.gathered),
        pairs_(evidence_.pairs),
        paper_(evidence_.paper),
        shapes_(model_.lamps()),
        near_(model_.lamps(), 0.0),
        centre_(model_.lamps(), 0.0),
        powers_(model_.lamps()),
        facing_(model_.lamps()),
        factors_(model_.lamps()) {
    add_known_albedo(evidence_.samples, evidence_.pairs);
  }

  /// Without earlier estimates.
  LampPosterior search(const Eigen::Vector3f& probe, const LampMemory& memory) {
    start(probe, memory);
    if (has_clipped(model_)) {
      start_gains();
      adopt(solve_lamps(model_, pairs_, paper_, shapes_, Search::rough));
    }
    mark_weak();
    for (int round = 0; round < kSearch.rounds; ++round) {
      bool changed = false;
      for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) changed |= !shapes_[lamp].weak && descend(lamp);
      if (!changed) break;
    }
    return solve_shapes();
  }
  /// From what was found on fewer samples.
  LampPosterior solve_from(const std::vector<LampShape>& shapes, LampMemory& memory) {
    shapes_ = shapes;
    tabulate_and_mark_weak();
    const std::optional<LampPosterior> found = solve_within_reach(memory);
    return with_distant(found ? *found : solve(memory), memory);
  }

  /// From earlier estimates; empty if a lamp moved out of the range searched around them.
  std::optional<LampPosterior> solve_near(const std::vector<std::optional<LampEstimate>>& before, LampMemory& memory) {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) start_at(lamp, *before[lamp]);
    tabulate_and_mark_weak();
    std::optional<LampPosterior> found = solve_within_reach(memory);
    if (!found) return std::nullopt;
    return with_distant(*std::move(found), memory);
  }

  /// From earlier estimates, of which those that did not change are held.
  LampPosterior follow(const std::vector<LampEstimate>& before, const std::vector<bool>& changed,
                       const LampMemory& memory) {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      start_at(lamp, before[lamp]);
      shapes_[lamp].held = !changed[lamp];
      shapes_[lamp].far = before[lamp].far;
      if (before[lamp].far) shapes_[lamp].inverse_distance = kSearch.distant_inverse[0];
    }
    const std::optional<LampPosterior> found = solve_within_reach(memory);
    return found ? *found : solve(memory);
  }

  std::vector<LampEstimate> estimates(const LampPosterior& found) const {
    std::vector<LampEstimate> result;
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      const LampShape& shape = found.shapes[lamp];
      LampEstimate estimate;
      const double inverse = shape.far ? near_[lamp] : std::max(shape.inverse_distance, kMinInverse);
      estimate.distance_m = static_cast<float>(1 / inverse);
      estimate.log_sigma = static_cast<float>(found.inverse_distance_sigma(lamp) / inverse);
      // Errors of gathered light that all pairs share shift the lamp's power, and no pair shows them.
      if (clipped(lamp))
        estimate.gain_log_sigma =
            static_cast<float>(std::hypot(found.gain_log_sigma(lamp), kLampParameters.posterior.model_error));
      estimate.flat = shape.flat;
      estimate.beam = shape.beam;
      estimate.far = shape.far;
      if (shape.beam) estimate.log_sigma = std::hypot(estimate.log_sigma, kSearch.beam_log_sigma);
      if (shape.flat) estimate.normal = model_.normal(lamp, shape);
      for (std::size_t c = 0; c < 3; ++c)
        estimate.gain[static_cast<Eigen::Index>(c)] = static_cast<float>(std::exp(shape.log_gain[c]));
      result.push_back(estimate);
    }
    return result;
  }

 private:
  static constexpr double kMinInverse = 0.01;  ///< 1/m: of a lamp that is published as infinitely far

  void start_at(std::size_t lamp, const LampEstimate& before) {
    LampShape& shape = shapes_[lamp];
    shape = {.inverse_distance = 1 / before.distance_m, .flat = before.flat, .beam = before.beam};
    near_[lamp] = shape.inverse_distance;
    if (model_.placed(lamp)) set_from_tag(lamp);
    if (shape.flat) shape.tilt = model_.tilt_of(lamp, before.normal);
    // At zero power the gradient vanishes: a lamp that was switched on would not be found.
    const double min_gain = unseen(lamp) ? kLampParameters.posterior.log_dim : 0;
    for (std::size_t c = 0; clipped(lamp) && c < 3; ++c)
      shape.log_gain[c] = std::max<double>(min_gain, std::log(before.gain[static_cast<Eigen::Index>(c)]));
  }

  LampPosterior solve(const LampMemory& memory) const {
    const std::optional<LampPrior> prior = memory.prior(model_, shapes_);
    return solve_lamps(model_, pairs_, paper_, shapes_, Search::fine, prior ? &*prior : nullptr);
  }

  /// Shading does not determine lamps that contribute less light to the samples than the error of the model. They keep
  /// their earlier distance, or that of the prior; their powers follow those of their kind.
  void mark_weak() {
    const std::vector<Eigen::Array3f> all = model_.irradiance(powers_, factors_);
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      float sum = 0;
      for (std::size_t i = 0; i < all.size(); ++i)
        sum += (powers_[lamp] * factors_[lamp][i]).mean() / std::max(all[i].mean(), 1e-9f);
      shapes_[lamp].weak =
          !unseen(lamp) && sum < kLampParameters.posterior.model_error * static_cast<float>(all.size());
    }
  }
  void tabulate_and_mark_weak() {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      model_.tabulate(lamp, {shapes_[lamp].inverse_distance}, 1);
      update(lamp);
    }
    mark_weak();
  }

  /// From shapes_, with visibility tabulated anew around lamps that leave its reach. Empty if they go on and on;
  /// shapes_ are then the last ones.
  std::optional<LampPosterior> solve_within_reach(const LampMemory& memory) {
    std::vector<bool> left(model_.lamps(), true);
    for (int round = 0; round < kSearch.follow_rounds; ++round) {
      for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp)
        if (left[lamp] && !shapes_[lamp].weak) tabulate_near(lamp);
      LampPosterior found = solve(memory);
      for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
        const double from = centre_[lamp], moved = found.shapes[lamp].inverse_distance - from;
        left[lamp] = !model_.placed(lamp) && !shapes_[lamp].weak && std::abs(moved) > kSearch.fine_limit * reach(from);
      }
      if (std::count(left.begin(), left.end(), true) == 0) return found;
      shapes_ = std::move(found.shapes);
    }
    return std::nullopt;
  }
  static double reach(double inverse_distance) {
    return std::max(kSearch.fine_reach * inverse_distance, kSearch.min_fine_reach);
  }

  /// Lamps at the usual height, or where they were kept; a panel faces the probe, the floor or the tag.
  void start(const Eigen::Vector3f& probe, const LampMemory& memory) {
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (model_.placed(lamp))
        model_.tabulate(lamp, {model_.inverse_distance_of(model_.light(lamp))}, 1);
      else
        model_.tabulate(lamp, spaced(0, kSearch.max_inverse_distance, kSearch.grid_steps), 1);
      const Eigen::Vector3f& direction = model_.light(lamp).direction;
      facing_[lamp] = {-direction};
      if (direction.z() > kSearch.facing_cosine) facing_[lamp].push_back(-Eigen::Vector3f::UnitZ());
      const Eigen::Vector3f to_tag =
          -(probe + static_cast<float>(kLampParameters.usual_distance_m) * direction).normalized();
      if (to_tag.dot(direction) < -kSearch.facing_cosine) facing_[lamp].push_back(to_tag);
      LampShape& shape = shapes_[lamp];
      shape = {};
      shape.inverse_distance = usual_inverse_distance(model_.light(lamp));
      if (const KeptLamp* kept = memory.kept_at(probe, model_.light(lamp)))
        shape.inverse_distance = 1 / static_cast<double>((kept->position_m - probe).norm());
      shape.flat = model_.light(lamp).squareness > kSearch.quadrilateral;
      if (shape.flat) shape.tilt = model_.tilt_of(lamp, facing_[lamp].back());
      if (model_.placed(lamp)) set_from_tag(lamp);
      update(lamp);
    }
  }

  /// Position and normal of a lamp with a tag.
  void set_from_tag(std::size_t lamp) {
    const PointLight& light = model_.light(lamp);
    shapes_[lamp].inverse_distance = model_.inverse_distance_of(light);
    if (!light.flat) return;
    shapes_[lamp].flat = true;
    shapes_[lamp].tilt = model_.tilt_of(lamp, light.normal);
  }
  bool shape_known(std::size_t lamp) const { return model_.placed(lamp) && model_.light(lamp).flat; }

  /// Solves once more if lamps are as good as infinitely far, and remembers the solution.
  LampPosterior with_distant(LampPosterior found, LampMemory& memory) {
    shapes_ = found.shapes;
    const std::vector<std::optional<double>> far = find_distant(found);
    if (std::any_of(far.begin(), far.end(), [](const auto& lamp) { return lamp.has_value(); })) {
      for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
        near_[lamp] = std::max(shapes_[lamp].inverse_distance, kMinInverse);
        if (!far[lamp]) continue;
        shapes_[lamp] = {.inverse_distance = *far[lamp], .log_gain = shapes_[lamp].log_gain, .far = true};
        tabulate_near(lamp);
      }
      found = solve(memory);
    }
    memory.keep(model_, found);
    return found;
  }

  /// Inverse distances of lamps that are more probably as good as infinitely far than where they were found; empty for
  /// the others. A minimum at a finite distance does not tell: that of the sun may be anywhere. Lamps that share the
  /// evidence cannot all be far: the likeliest go first, each is judged with those before it.
  std::vector<std::optional<double>> find_distant(const LampPosterior& found) {
    std::vector<Eigen::Array3f> powers;
    std::vector<std::vector<float>> factors(model_.lamps()), distant(model_.lamps());
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      powers.push_back(model_.power(lamp, found.shapes[lamp]));
      model_.factors(lamp, found.shapes[lamp], factors[lamp]);
    }
    // In pairs: 2v (-log p), with the prior.
    const auto cost_of = [&](std::size_t lamp) {
      std::swap(factors[lamp], distant[lamp]);
      model_.log_albedo(powers, factors, log_albedo_);
      std::swap(factors[lamp], distant[lamp]);
      return robust_cost(log_albedo_, pairs_, 1) +
             2 * found.pair_variance * found.log_ceiling_prior(model_.light(lamp), lamp);
    };
    model_.log_albedo(powers, factors, log_albedo_);
    double now = robust_cost(log_albedo_, pairs_, 1);
    std::vector<std::pair<double, std::size_t>> likeliest;
    std::vector<double> inverses(model_.lamps());
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (model_.placed(lamp) || shapes_[lamp].weak) continue;
      double least = std::numeric_limits<double>::infinity();
      std::vector<float> best;
      for (const double inverse : kSearch.distant_inverse) {
        model_.tabulate(lamp, {inverse}, kSearch.fine_rays);
        model_.factors(lamp, {.inverse_distance = inverse}, distant[lamp]);
        if (const double alone = cost_of(lamp); alone < least) {
          least = alone;
          best = distant[lamp];
          inverses[lamp] = inverse;
        }
      }
      distant[lamp] = std::move(best);
      likeliest.emplace_back(least, lamp);
    }
    std::sort(likeliest.begin(), likeliest.end());
    std::vector<std::optional<double>> result(model_.lamps());
    for (const auto& [alone, lamp] : likeliest) {
      const double cost = cost_of(lamp);
      if (cost > now) continue;
      std::swap(factors[lamp], distant[lamp]);
      now = cost - 2 * found.pair_variance * found.log_ceiling_prior(model_.light(lamp), lamp);
      result[lamp] = inverses[lamp];
    }
    return result;
  }

  void tabulate_near(std::size_t lamp) {
    const LampShape& shape = shapes_[lamp];
    const double at = centre_[lamp] = shape.inverse_distance;
    if (model_.placed(lamp) || shape.far || shape.held)
      model_.tabulate(lamp, {at}, kSearch.fine_rays);
    else
      model_.tabulate(lamp, spaced(std::max(0.0, at - reach(at)), at + reach(at), kSearch.fine_steps),
                      kSearch.fine_rays);
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

  void adopt(const LampPosterior& found) {
    shapes_ = found.shapes;
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
      const double here = cost(min_cost);
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

  double cost(double limit = std::numeric_limits<double>::infinity()) {
    model_.log_albedo(powers_, factors_, log_albedo_);
    return cost_of_albedo(limit);
  }
  /// At least `limit` where it is not less.
  double cost_of_albedo(double limit = std::numeric_limits<double>::infinity()) const {
    const double scale = variance_ * albedo_scale_cost(model_, log_albedo_, paper_), factor = penalty(shapes_);
    const double of_pairs =
        robust_cost(log_albedo_, pairs_, kLampParameters.posterior.wide_level, limit / factor - scale);
    return (of_pairs + scale) * factor;
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
        const double here = cost_of_albedo(min_cost);
        if (here >= min_cost) continue;
        min_cost = here;
        best = shapes_[lamp];
      }
    };
    for (const double inverse : model_.tabulated(lamp)) {
      if (shape_known(lamp)) {
        consider({inverse, true, before.tilt});
        continue;
      }
      consider({inverse, false, {}});
      if (before.flat) consider({inverse, true, before.tilt});
      for (const Eigen::Vector3f& normal : facing_[lamp]) consider({inverse, true, model_.tilt_of(lamp, normal)});
    }
    shapes_[lamp] = best;
    update(lamp);
    return best.inverse_distance != before.inverse_distance || best.flat != before.flat || best.tilt != before.tilt ||
           best.log_gain != before.log_gain;
  }

  /// Solves all lamps together, then tries each lamp that the fish-eye does not see switched off, and each of the
  /// strongest with a doubtful outline in the other shape.
  LampPosterior solve_shapes() {
    LampPosterior best = solve_lamps(model_, pairs_, paper_, shapes_, Search::rough);
    double min_cost = best.cost * penalty(best.shapes);
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      if (!unseen(lamp)) continue;
      std::vector<LampShape> other = best.shapes;
      other[lamp].log_gain = {};
      const LampPosterior tried = solve_lamps(model_, pairs_, paper_, other, Search::rough);
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
      const LampPosterior tried = solve_lamps(model_, pairs_, paper_, other, Search::rough);
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
  void try_beams(LampPosterior& best, double min_cost) const {
    for (std::size_t lamp = 0; lamp < std::min<std::size_t>(kSearch.shaped, model_.lamps()); ++lamp) {
      if (model_.placed(lamp) || best.shapes[lamp].inverse_distance < 1 / kSearch.max_beam_distance_m) continue;
      std::vector<LampShape> other = best.shapes;
      if (!other[lamp].flat) other[lamp].tilt = {};
      other[lamp].flat = other[lamp].beam = true;
      other[lamp].inverse_distance *= kSearch.beam_nearer;
      const LampPosterior tried = solve_lamps(model_, pairs_, paper_, other, Search::rough);
      const double cost = tried.cost * penalty(tried.shapes);
      if (cost > kSearch.max_beam_cost * min_cost || min_cost - cost < kSearch.min_beam_gain * total_weight(pairs_))
        continue;
      best = tried;
      min_cost = cost;
    }
  }

  Evidence evidence_;
  ShadingModel model_;
  const std::vector<SamplePair>& pairs_;
  int paper_;
  std::vector<LampShape> shapes_;
  std::vector<double> near_;    ///< inverse distances that lamps would have if they were not infinitely far
  std::vector<double> centre_;  ///< of the tabulated inverse distances
  double variance_ = kLampParameters.posterior.usual_pair_variance;
  std::vector<Eigen::Array3f> powers_;
  std::vector<std::vector<Eigen::Vector3f>> facing_;
  std::vector<std::vector<float>> factors_;
  std::vector<Eigen::Array3f> log_albedo_;
};

}  // namespace

std::vector<LampEstimate> locate_lamps(const IrradianceModel& room, const Illumination& illumination,
                                       const std::vector<SurfaceSample>& samples,
                                       const std::vector<Eigen::Vector3f>& gathered,
                                       const std::optional<SurfaceSample>& paper,
                                       const std::vector<std::optional<LampEstimate>>& before, LampMemory& memory,
                                       Search how) {
  if (illumination.lights.empty()) return {};
  const Eigen::Vector3f on_paper =
      paper ? room.gather(paper->position, paper->normal, kSearch.paper_rays).irradiance : Eigen::Vector3f();
  const auto search_on = [&](std::size_t stride) {
    Evidence evidence(samples, gathered, stride);
    if (paper) evidence.add_paper(*paper, on_paper);
    return LampSearch(room, illumination, std::move(evidence));
  };
  const bool all_known = before.size() == illumination.lights.size() &&
                         std::all_of(before.begin(), before.end(), [](const auto& lamp) { return lamp.has_value(); });
  if (all_known) {
    LampSearch near = search_on(1);
    if (const auto found = near.solve_near(before, memory)) return near.estimates(*found);
  }
  LampSearch coarse = search_on(kSearch.stride);
  const LampPosterior found = coarse.search(illumination.probe_position_m, memory);
  if (how == Search::rough) return coarse.estimates(found);
  LampSearch fine = search_on(1);
  return fine.estimates(fine.solve_from(found.shapes, memory));
}

std::vector<LampEstimate> follow_lamps(const IrradianceModel& room, const Illumination& illumination,
                                       const std::vector<SurfaceSample>& samples,
                                       const std::vector<Eigen::Vector3f>& gathered,
                                       const std::vector<LampEstimate>& before, const std::vector<bool>& changed,
                                       const LampMemory& memory) {
  LampSearch search(room, illumination, Evidence(samples, gathered, 1));
  std::vector<LampEstimate> result = search.estimates(search.follow(before, changed, memory));
  for (std::size_t lamp = 0; lamp < result.size(); ++lamp)
    if (!changed[lamp]) result[lamp] = before[lamp];
  return result;
}

}  // namespace lumigraft::reconstruct
