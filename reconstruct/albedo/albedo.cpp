#include "reconstruct/albedo/albedo.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "capture/message_text.h"
#include "reconstruct/albedo/albedo_bricks.h"
#include "reconstruct/albedo/albedo_warnings.h"
#include "reconstruct/albedo/clipped_albedo.h"
#include "reconstruct/albedo/incremental_solver.h"
#include "reconstruct/albedo/kept_albedo.h"
#include "reconstruct/albedo/known_surface.h"
#include "reconstruct/albedo/missing_light.h"
#include "reconstruct/albedo/parameters.h"
#include "reconstruct/albedo/sample_solver.h"
#include "reconstruct/albedo/surface_lighting.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/lamps/lamp_placement.h"
#include "reconstruct/lamps/lamp_reflections.h"
#include "reconstruct/lamps/out_of_view_lamps.h"
#include "reconstruct/light/extrinsics_check.h"
#include "reconstruct/light/lamp_merge.h"
#include "reconstruct/math/tag_family.h"
#include "reconstruct/room/enclosure.h"
#include "reconstruct/shading/clipped_walls.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/noise_floor.h"
#include "reconstruct/shading/surface_samples.h"
#include "reconstruct/shading/truncated_samples.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const AlbedoParameters::Stage& kStage = kAlbedoParameters.stage;
constexpr const AlbedoParameters::Following& kFollowing = kAlbedoParameters.following;

bool is_known(const LampEstimate& estimate) { return !estimate.far && estimate.distance_m < kStage.max_distance_m; }

std::vector<PointLight> placed(const Illumination& illumination, const std::vector<LampEstimate>& estimates) {
  std::vector<PointLight> lights = illumination.lights;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const LampEstimate& estimate = estimates[i];
    PointLight& light = lights[i];
    light.irradiance = light.irradiance.cwiseProduct(estimate.gain);
    if (light.clipped) light.power_log_sigma = estimate.gain_log_sigma;
    if (light.distance_known) {  // from its tag
      light.intensity = light.irradiance * (light.position_m - illumination.probe_position_m).squaredNorm();
      light.flat = estimate.flat;
      light.normal = estimate.normal;
      continue;
    }
    light.distance_known = is_known(estimate);
    if (!light.distance_known) continue;
    set_distance(light, estimate.distance_m, illumination.probe_position_m);
    light.distance_log_sigma = estimate.log_sigma;
    light.flat = estimate.flat;
    light.normal = estimate.normal;
  }
  return lights;
}

/// The lamps when their positions were estimated.
struct Located {
  std::size_t points = 0;
  double weight = 0;  ///< of the measurements of the surface
  std::vector<PointLight> lights;
  int solves = 0;

  bool grown(double points_now, double weight_now) const {
    return points_now > kStage.locate_growth * static_cast<double>(points) ||
           weight_now > kStage.locate_weight * weight;
  }
  bool holds(const Illumination& illumination) const {
    const std::vector<PointLight>& now = illumination.lights;
    if (now.size() != lights.size()) return false;
    return std::all_of(now.begin(), now.end(), [&](const PointLight& light) {
      const PointLight* was = lamp_with_id(lights, light.id);
      return was && same_place(*was, light, illumination.probe_position_m) && same_power(*was, light);
    });
  }
  static bool same_power(const PointLight& was, const PointLight& now) {
    return (was.irradiance - now.irradiance).norm() < kStage.same_irradiance * was.irradiance.norm();
  }
  static bool same_place(const PointLight& was, const PointLight& now, const Eigen::Vector3f& probe_m) {
    return was.clipped == now.clipped && was.direction.dot(now.direction) > kStage.same_direction &&
           now.visibility == PointLight::Visibility::visible && was.distance_known == now.distance_known &&
           (was.position_m - now.position_m).norm() <= kStage.same_position * (now.position_m - probe_m).norm();
  }
};

/// Of all lamps' irradiance at the probe.
float share_of(const PointLight& light, const Illumination& illumination) {
  float all = 0;
  for (const PointLight& lamp : illumination.lights) all += lamp.irradiance.mean();
  return light.irradiance.mean() / std::max(all, 1e-9f);
}

/// Absolute change of the environment over its sum.
float environment_change(const EnvironmentMap& now, const EnvironmentMap& before) {
  if (now.radiance.data.size() != before.radiance.data.size()) return 1;
  double change = 0, sum = 0;
  for (std::size_t i = 0; i < now.radiance.data.size(); ++i) {
    change += std::abs(now.radiance.data[i] - before.radiance.data[i]);
    sum += before.radiance.data[i];
  }
  return static_cast<float>(change / std::max(sum, 1e-12));
}

}  // namespace

struct AlbedoStage::State {
  explicit State(const capture::Session& session)
      : metal(session), fisheye(session.fisheye), print_m(print_edge_m(session.tag)), tagged_lamps(session.lamps) {}

  /// Lamp estimates: earlier ones while they hold, else from shading.
  std::vector<LampEstimate> locate(const IrradianceModel& room, const Illumination& illumination,
                                   const Surface& surface, const std::vector<Eigen::Vector3f>& gathered);

  /// The incremental solution; empty if a complete one is needed.
  std::optional<Result> solve_incremental(const DistanceField& field, const Illumination& illumination,
                                          bool even_if_due);
  std::optional<Result> follow_light(const DistanceField& field, const Illumination& illumination);
  struct Followed {
    std::vector<LampEstimate> lamps;
    std::vector<bool> changed;
  };
  std::optional<Followed> known_lamps(const Illumination& merged) const;
  bool search_changed(const DistanceField& field, const IrradianceModel& room, const Illumination& merged,
                      Followed& follow);
  void place_lamps(const std::shared_ptr<Illumination>& lit, const Illumination& merged,
                   const std::vector<LampEstimate>& lamps, const OutOfViewLamps& unseen, const DistanceField& field,
                   const FieldRays& rays);
  void add_warnings(const Illumination& lit);
  std::vector<ReflectingPlane> find_mirrors(const DistanceField& field, const std::vector<RoomPoint>& known_points);
  void remember_albedo();

  /// Enclosure, irradiance model, gathered light of the samples and lamp positions of a complete solution. `merged`:
  /// the lamps of `lit` with pieces merged; `lit` gets its clipped walls raised; `surface` its usable samples.
  std::vector<PointLight> light_surface(const DistanceField& field, const FieldRays& rays,
                                        const std::vector<RoomPoint>& known_points, const Illumination& merged,
                                        Illumination& lit, Surface& surface, std::optional<IrradianceModel>& room,
                                        std::vector<Eigen::Vector3f>& gathered);

  /// Checks the fish-eye's pose, again when much more of the room is known.
  void check_extrinsics(const DistanceField& field, const FieldRays& rays, const Illumination& illumination,
                        std::size_t points);

  MetalMask metal;
  std::optional<capture::FisheyeCamera> fisheye;
  int check_solves = 0;            ///< complete solutions since the check of the fish-eye's pose
  std::size_t checked_points = 0;  ///< surface points at that check
  std::string extrinsics_found;    ///< warning of that check, or empty
  double print_m;                  ///< edge of the tag with its paper
  std::vector<capture::TaggedLamp> tagged_lamps;
  std::uint64_t version = 0;
  bool solved = false;
  std::uint64_t field_version = 0, illumination_version = 0;
  Result last;
  struct KnownLamp {
    LampEstimate estimate;
    PointLight light;  ///< as measured then
    float share = 0;   ///< of all lamps' irradiance at the probe when it was estimated
  };
  std::map<int, KnownLamp> estimates;  ///< by the lamp's id; also of lamps that are off now
  std::size_t searched_points = 0;     ///< surface points when lamps were last searched without earlier estimates
  LampMemory lamp_memory;
  ReflectionFilter reflections;
  bool held = false;
  Located located;
  std::vector<PointLight> last_lamps;  ///< with their estimated positions
  float sample_m = 0;                  ///< edge of cells; it only grows, so that samples stay the same
  GatherCache gather_cache;
  EnclosureStage enclosure;
  std::shared_ptr<const Enclosure> closed;  ///< in which gather_cache was filled,
  bool rough = false;                       ///< and whether with few rays
  IncrementalSolver incremental;
  float model_error = 0;                       ///< of the last complete solution
  std::map<SampleCell, SampleAlbedo> known;    ///< albedo as solved under earlier light
  Illumination solved_light;                   ///< measured, of the last complete solution,
  Illumination followed_light;                 ///< and of the last one of any kind
  KnownSurface known_surface;                  ///< of the last complete solution
  std::size_t solved_bricks = 0;               ///< of the field then
  int followed = 0;                            ///< solutions of lamps that moved since then
  bool empty = false;                          ///< no surface is known
  IrradianceModel::Surroundings surroundings;  ///< of the last complete solution,
  std::vector<Eigen::Vector3f> floor_grid;     ///< its lamp light on the unseen floor,
  EnvironmentMap environment;                  ///< and its measured environment
};

std::vector<LampEstimate> AlbedoStage::State::locate(const IrradianceModel& room, const Illumination& illumination,
                                                     const Surface& surface,
                                                     const std::vector<Eigen::Vector3f>& gathered) {
  const std::size_t points = surface.points.size();
  std::vector<LampEstimate> result;
  double weight = 0;
  for (const SurfacePoint& point : surface.points) weight += double{point.weight};
  const bool due = located.solves >= kStage.locate_solves || located.grown(static_cast<double>(points), weight);
  if ((!due || held) && located.holds(illumination)) {
    ++located.solves;
    for (const PointLight& light : illumination.lights) result.push_back(estimates.at(light.id).estimate);
    return result;
  }
  if (static_cast<double>(points) > kStage.search_growth * static_cast<double>(searched_points)) {
    estimates.clear();
    searched_points = points;
  }
  if (located.weight > 0) lamp_memory.outweigh(weight / located.weight);
  std::vector<std::optional<LampEstimate>> before;
  for (const PointLight& light : illumination.lights) {
    const auto estimate = estimates.find(light.id);
    before.push_back(estimate == estimates.end() ? std::nullopt : std::optional(estimate->second.estimate));
  }
  result = locate_lamps(room, illumination, surface.samples, gathered, tag_paper(surface.points, print_m), before,
                        lamp_memory, rough ? Search::rough : Search::fine);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const PointLight& light = illumination.lights[i];
    if (!light.distance_known) continue;
    result[i].distance_m = (light.position_m - illumination.probe_position_m).norm();
    result[i].log_sigma = light.distance_log_sigma;
    if (!light.flat) continue;
    result[i].flat = true;
    result[i].normal = light.normal;
  }
  for (std::size_t i = 0; i < result.size(); ++i) {
    const PointLight& light = illumination.lights[i];
    estimates[light.id] = {result[i], light, share_of(light, illumination)};
  }
  if (estimates.size() > kStage.max_estimates)
    std::erase_if(estimates, [&](const auto& entry) { return !lamp_with_id(illumination.lights, entry.first); });
  located = {points, weight, illumination.lights, 0};
  return result;
}

void AlbedoStage::State::check_extrinsics(const DistanceField& field, const FieldRays& rays,
                                          const Illumination& illumination, std::size_t points) {
  if (illumination.from_shading) return;
  const bool hidden = std::any_of(illumination.lights.begin(), illumination.lights.end(),
                                  [](const PointLight& light) { return light.hidden > 0 || light.covered; });
  const bool grown = static_cast<double>(points) > kStage.search_growth * static_cast<double>(checked_points);
  if (fisheye && !hidden && (grown || ++check_solves >= kStage.check_solves)) {
    checked_points = points;
    check_solves = 0;
    const std::optional<ExtrinsicsError> error = extrinsics_error(field, rays, metal, illumination, *fisheye);
    extrinsics_found = error ? extrinsics_warning(*error) : "";
  }
}

AlbedoStage::AlbedoStage(const capture::Session& session) : state_(std::make_unique<State>(session)) {}
AlbedoStage::~AlbedoStage() = default;

void AlbedoStage::hold(bool hold) { state_->held = hold; }

void AlbedoStage::restore_lamps(std::vector<KeptLamp> kept) { state_->lamp_memory.restore(std::move(kept)); }

std::vector<KeptLamp> AlbedoStage::lamps_to_keep() const {
  const State& s = *state_;
  std::vector<KeptLamp> result;
  for (const PointLight& light : s.last_lamps) {
    const auto found = s.estimates.find(light.id);
    if (!light.distance_known || light.lamp_tag >= 0 || light.distance_log_sigma > kStage.guess_log_sigma ||
        s.followed_light.from_shading || found == s.estimates.end())
      continue;
    result.push_back(
        {light.position_m, light.radius_m, light.distance_log_sigma, light.flat, found->second.estimate.beam});
  }
  const std::vector<KeptLamp>& earlier = s.lamp_memory.kept();
  result.insert(result.end(), earlier.begin(), earlier.end());
  if (result.size() > kLampParameters.memory.max_kept) result.resize(kLampParameters.memory.max_kept);
  return result;
}

std::optional<AlbedoStage::Result> AlbedoStage::State::solve_incremental(const DistanceField& field,
                                                                         const Illumination& illumination,
                                                                         bool even_if_due) {
  if (!solved) return std::nullopt;
  if (field_version == field.version && illumination_version == illumination.version) return last;
  if (followed > 0 ||
      (!held && environment_change(illumination.environment, environment) > kStage.max_environment_change))
    return std::nullopt;
  const IncrementalSolver::Change change = held ? incremental.grown(field) : incremental.change(field);
  const bool due = change.fraction > kStage.max_changed_fraction || located.grown(change.points, change.weight) ||
                   located.solves >= kStage.incremental_solves;
  if (due && !even_if_due) return std::nullopt;
  const FieldRays rays(field);
  auto lit = std::make_shared<Illumination>(reflections.without_reflections(illumination, field, rays));
  const OutOfViewLamps unseen(*lit, rays);
  Illumination merged = *lit;
  merged.lights = merge_pieces(lit->lights);
  if (!located.holds(merged)) return std::nullopt;
  ++located.solves;
  std::vector<LampEstimate> lamps;
  for (const PointLight& light : merged.lights) lamps.push_back(estimates.at(light.id).estimate);
  followed_light = illumination;
  if (illumination.version != illumination_version) {
    place_lamps(lit, merged, lamps, unseen, field, rays);
  }
  last.complete = false;
  last.due = due;
  const IrradianceModel room(field, rays, metal, closed.get(), surroundings);
  auto albedo = std::make_shared<AlbedoField>(*last.albedo);
  last.samples =
      incremental.solve(field, rays, metal, {room, *last.illumination, floor_grid, kStage.gather_rays, model_error},
                        change, albedo->bricks);
  if (!change.bricks.empty()) {
    extend_to_clipped(field, metal, room, *last.illumination, albedo->bricks);
    albedo->version = ++version;
    last.albedo = albedo;
  }
  field_version = field.version;
  illumination_version = illumination.version;
  return last;
}

/// The last solution becomes prior knowledge of those under another light; errors common to all samples limit it. What
/// was solved in a guessed light is no knowledge.
void AlbedoStage::State::remember_albedo() {
  if (solved_light.dimmed) return;  // it follows from what is known
  known.clear();
  if (solved_light.from_shading || last.light_is_missing) return;
  const float common = common_error(*last.illumination);
  known = incremental.albedo();
  for (auto& [cell, sample] : known) sample.sigma = sigma_later(sample, common);
}

void AlbedoStage::State::add_warnings(const Illumination& lit) {
  if (empty) last.warnings.push_back(kNoSurface);
  if (lit.from_shading) return;  // one warning says that all of the light is uncertain
  std::vector<LampEstimate> lamps;
  for (const PointLight& light : lit.lights) {
    if (const auto estimate = estimates.find(light.id); estimate != estimates.end())
      lamps.push_back(estimate->second.estimate);
  }
  for (std::string& warning : lamp_warnings(lit.lights, lamps)) last.warnings.push_back(std::move(warning));
  if (!extrinsics_found.empty()) last.warnings.push_back(extrinsics_found);
}

std::optional<AlbedoStage::Result> AlbedoStage::solve_incremental(const DistanceField& field,
                                                                  const Illumination& illumination, bool even_if_due) {
  return state_->solve_incremental(field, illumination, even_if_due);
}

/// Publishes the light with its lamps at these estimates; `merged`: those of `lit` with pieces merged.
void AlbedoStage::State::place_lamps(const std::shared_ptr<Illumination>& lit, const Illumination& merged,
                                     const std::vector<LampEstimate>& lamps, const OutOfViewLamps& unseen,
                                     const DistanceField& field, const FieldRays& rays) {
  last_lamps = placed(merged, lamps);
  raise_clipped(*lit, last_lamps, closed.get(), field, rays, metal);
  lit->lights = place_pieces(lit->lights, merged.lights, last_lamps, lit->probe_position_m);
  last.warnings.clear();
  unseen.resolve(*lit, tagged_lamps, last.warnings);
  add_warnings(*lit);
  last.illumination = lit;
}

/// The known estimates of these lamps, and which of them do not hold; empty if a lamp is new.
std::optional<AlbedoStage::State::Followed> AlbedoStage::State::known_lamps(const Illumination& merged) const {
  Followed result;
  for (const PointLight& light : merged.lights) {
    const auto before = estimates.find(light.id);
    if (before == estimates.end()) return std::nullopt;
    const PointLight& was = before->second.light;
    result.lamps.push_back(before->second.estimate);
    const bool carried = !Located::same_place(was, light, merged.probe_position_m);
    // Where others were switched off shading determines this one much better.
    const float share = share_of(light, merged);
    const bool clearer = !before->second.estimate.far && share > kFollowing.min_share &&
                         share > kFollowing.clearer_share * before->second.share;
    result.changed.push_back(carried || clearer || (light.clipped && !Located::same_power(was, light)));
    // The power of a lamp that was carried is as before.
    if (carried && !light.clipped && !light.distance_known)
      result.lamps.back().distance_m *= std::sqrt(was.irradiance.mean() / std::max(light.irradiance.mean(), 1e-9f));
  }
  return result;
}

/// Searches the lamps that changed, on known surface; false if too little of it is left.
bool AlbedoStage::State::search_changed(const DistanceField& field, const IrradianceModel& room,
                                        const Illumination& merged, Followed& follow) {
  const std::vector<SurfaceSample> samples = known_surface.in(field);
  if (samples.empty() ||
      static_cast<float>(samples.size()) < kFollowing.min_samples_fraction * static_cast<float>(known_surface.size()))
    return false;
  floor_grid = room.lamp_irradiance_on_floor(placed(merged, follow.lamps));
  std::vector<Eigen::Vector3f> gathered;
  for (const SurfaceSample& sample : samples) {
    const IrradianceModel::Gathered own = room.gather(sample.position, sample.normal, kFollowing.gather_rays);
    gathered.push_back(own.irradiance + room.irradiance_from_floor(own, floor_grid));
  }
  follow.lamps = follow_lamps(room, merged, samples, gathered, follow.lamps, follow.changed, lamp_memory);
  ++followed;
  return true;
}

std::optional<AlbedoStage::Result> AlbedoStage::State::follow_light(const DistanceField& field,
                                                                    const Illumination& illumination) {
  if (!solved || illumination.from_shading || followed >= kFollowing.solves ||
      !(relative_change(illumination, followed_light) > kFollowing.min_change) ||
      static_cast<double>(field.bricks.size()) > kStage.locate_growth * static_cast<double>(solved_bricks))
    return std::nullopt;
  const FieldRays rays(field);
  auto lit = std::make_shared<Illumination>(reflections.without_reflections(illumination, field, rays));
  const OutOfViewLamps unseen(*lit, rays);
  Illumination merged = *lit;
  merged.lights = merge_pieces(lit->lights);
  std::optional<Followed> follow = known_lamps(merged);
  if (!follow) return std::nullopt;
  const bool any_changed = std::count(follow->changed.begin(), follow->changed.end(), true) > 0;
  const IncrementalSolver::Change grown = incremental.grown(field);
  std::optional<IrradianceModel> room;
  if (any_changed || !grown.bricks.empty()) room.emplace(field, rays, metal, *lit, closed.get());
  if (any_changed && !search_changed(field, *room, merged, *follow)) return std::nullopt;
  for (std::size_t i = 0; i < follow->lamps.size(); ++i) {
    const PointLight& light = merged.lights[i];
    KnownLamp& lamp = estimates.at(light.id);
    lamp = {follow->lamps[i], light, follow->changed[i] ? share_of(light, merged) : lamp.share};
  }
  located.lights = merged.lights;
  place_lamps(lit, merged, follow->lamps, unseen, field, rays);
  if (!grown.bricks.empty()) {
    auto albedo = std::make_shared<AlbedoField>(*last.albedo);
    last.samples = incremental.solve(field, rays, metal, {*room, *lit, floor_grid, kStage.gather_rays, model_error},
                                     grown, albedo->bricks);
    extend_to_clipped(field, metal, *room, *lit, albedo->bricks);
    albedo->version = ++version;
    last.albedo = albedo;
  }
  last.complete = false;
  last.due |= followed > 0 || relative_change(illumination, solved_light) > kStage.other_light;
  environment = illumination.environment;
  illumination_version = illumination.version;
  followed_light = illumination;
  return last;
}

std::optional<AlbedoStage::Result> AlbedoStage::follow_light(const DistanceField& field,
                                                             const Illumination& illumination) {
  return state_->follow_light(field, illumination);
}

AlbedoStage::Result AlbedoStage::solve(const DistanceField& field, const Illumination& illumination) {
  State& s = *state_;
  const std::optional<Result> result = s.solve_incremental(field, illumination, false);
  return result ? *result : solve_complete(field, illumination);
}

/// Planes that reflect the room are metal from here on, in place of the earlier ones.
std::vector<ReflectingPlane> AlbedoStage::State::find_mirrors(const DistanceField& field,
                                                              const std::vector<RoomPoint>& known_points) {
  metal.set_mirrors({});
  std::vector<ReflectingPlane> mirrors = find_reflecting_planes(known_points, field, metal);
  std::vector<MirrorPlane> planes;
  for (const ReflectingPlane& mirror : mirrors) planes.push_back(mirror.plane);
  metal.set_mirrors(std::move(planes));
  // Which of the rays met metal is stored with the light.
  if (mirrors.size() != last.mirrors.size()) gather_cache.forget();
  return mirrors;
}

std::vector<PointLight> AlbedoStage::State::light_surface(const DistanceField& field, const FieldRays& rays,
                                                          const std::vector<RoomPoint>& known_points,
                                                          const Illumination& merged, Illumination& lit,
                                                          Surface& surface, std::optional<IrradianceModel>& room,
                                                          std::vector<Eigen::Vector3f>& gathered) {
  std::vector<bool> smooth;  // without the tag's print, which is black and white
  const std::vector<bool> truncated = truncated_samples(field, surface);
  for (std::size_t i = 0; i < surface.samples.size(); ++i)
    smooth.push_back(surface.samples[i].usable && !truncated[i] && !on_tag_print(surface.samples[i], print_m));
  bool first = last_lamps.empty();
  std::vector<PointLight> lamps = first ? merged.lights : last_lamps;
  for (;;) {
    Illumination placed_light = lit;
    placed_light.lights = lamps;
    const std::shared_ptr<const Enclosure> now_closed = enclosure.close(field, known_points, placed_light);
    if (!first) raise_clipped(lit, lamps, now_closed.get(), field, rays, metal);
    if (now_closed != closed || rough) gather_cache.forget();
    closed = now_closed;
    rough = first && closed;  // a second pass follows
    room.emplace(field, rays, metal, lit, closed.get());
    const std::vector<IrradianceModel::Gathered> light = gather_cache.gather(
        *room, lit, surface.samples, surface.points.size(), rough ? kStage.rough_gather_rays : kStage.gather_rays);
    const auto add_floor = [&] {
      floor_grid = room->lamp_irradiance_on_floor(lamps);
      for (std::size_t i = 0; i < light.size(); ++i)
        gathered[i] = gathered_light(*room, light[i], floor_grid, surface.samples[i]);
    };
    bool floor = false;
    for (std::size_t i = 0; i < light.size(); ++i) {
      surface.samples[i].usable = smooth[i] && light[i].metal_fraction < kStage.max_metal_fraction;
      floor |= !light[i].floor_hits.empty();
    }
    add_floor();
    lamps = placed(merged, locate(*room, merged, surface, gathered));
    if (floor) add_floor();
    // The enclosure and the light from an unseen floor depend on lamp positions: the first solution finds these
    // roughly, then again.
    if (!first || !(floor || closed || !lit.environment.clipped.empty())) return lamps;
    first = false;
    located = {};
  }
}

AlbedoStage::Result AlbedoStage::solve_complete(const DistanceField& field, const Illumination& illumination) {
  State& s = *state_;

  const FieldRays rays(field);
  const std::vector<RoomPoint> known_points = room_points(field);
  std::vector<ReflectingPlane> mirrors = s.find_mirrors(field, known_points);
  auto lit = std::make_shared<Illumination>(s.reflections.without_reflections(illumination, field, rays));
  const OutOfViewLamps unseen(*lit, rays);
  Surface surface = find_surface(field, rays, s.metal, kStage.max_samples, s.sample_m);
  s.sample_m = surface.sample_m;
  if (s.solved && relative_change(illumination, s.solved_light) > kStage.other_light) s.remember_albedo();
  s.solved_light = s.followed_light = illumination;
  s.solved_bricks = field.bricks.size();
  s.followed = 0;
  for (std::size_t i = 0; i < surface.samples.size(); ++i)
    if (const auto known = s.known.find(surface.cells[i]); known != s.known.end())
      surface.samples[i].known = known->second;
  Illumination merged = *lit;
  merged.lights = merge_pieces(lit->lights);
  std::optional<IrradianceModel> room;
  std::vector<Eigen::Vector3f> gathered(surface.samples.size());
  const std::vector<PointLight> lamps =
      s.light_surface(field, rays, known_points, merged, *lit, surface, room, gathered);
  s.last_lamps = lamps;
  lit->lights = place_pieces(lit->lights, merged.lights, lamps, lit->probe_position_m);
  std::vector<std::string> warnings;
  unseen.resolve(*lit, s.tagged_lamps, warnings);

  const float noise_floor = noise_floor_radiance(surface.samples);
  s.model_error = model_error(surface.samples, noise_floor, s.lamp_memory.misfit());
  const SurfaceLighting points(surface, *room, *lit, gathered, noise_floor, s.model_error);
  const std::vector<SampleAlbedo> albedo =
      solve_albedo(surface.samples, points.sample_light(), points.neighbours(), noise_floor);
  const std::vector<PointAlbedo> of_points = points.albedo(albedo);
  auto result = std::make_shared<AlbedoField>();
  result->voxel_m = field.voxel_m;
  result->version = ++s.version;
  result->bricks = albedo_bricks(surface.points, of_points);
  extend_to_clipped(field, s.metal, *room, *lit, result->bricks);
  if (s.last.albedo) keep_unchanged(result->bricks, s.last.albedo->bricks);

  s.incremental.keep(field, surface, gathered, albedo, of_points, noise_floor);
  s.known_surface = KnownSurface(surface, albedo, s.print_m);
  s.surroundings = room->surroundings();
  s.environment = illumination.environment;
  auto occluders =
      std::make_shared<BrickMap<FieldBrick>>(carve_occluders(field, rays, surface.samples, points.shadows()));
  s.last = {result, lit,   std::move(occluders),  std::move(mirrors), std::move(warnings),
            true,   false, surface.samples.size()};
  s.last.light_is_missing =
      !lit->from_shading && reflected_over_possible(surface, points.sample_light(), *room, *lit, s.print_m) >
                                kAlbedoParameters.missing_light.max_reflected;
  s.empty = surface.points.empty();
  if (!s.last.light_is_missing) s.check_extrinsics(field, rays, illumination, surface.points.size());
  s.add_warnings(*lit);
  s.solved = true;
  s.field_version = field.version;
  s.illumination_version = illumination.version;
  return s.last;
}

}  // namespace lumigraft::reconstruct
