#include "reconstruct/albedo/albedo.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "reconstruct/albedo/albedo_bricks.h"
#include "reconstruct/albedo/gather_cache.h"
#include "reconstruct/albedo/incremental_solver.h"
#include "reconstruct/albedo/sample_solver.h"
#include "reconstruct/albedo/surface_points.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/lamps/lamp_filter.h"
#include "reconstruct/lamps/lamp_placement.h"
#include "reconstruct/lamps/lamp_reflections.h"
#include "reconstruct/lamps/out_of_view_lamps.h"
#include "reconstruct/light/extrinsics_check.h"
#include "reconstruct/light/lamp_merge.h"
#include "reconstruct/room/enclosure.h"
#include "reconstruct/shading/clipped_walls.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/noise_floor.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {
namespace {

constexpr int kSamples = 2500;
constexpr int kGatherRays = 64, kRoughRays = 16;
constexpr float kMostMetal = 0.1f;        ///< share of what a sample sees that may be metal
constexpr double kGrown = 1.5;            ///< when so much more surface is known, lamps are searched from nothing
constexpr double kMoreSurface = 1.1;      ///< when so much more is known, they are looked for around where they were
constexpr float kLampTurn = 0.9999f;      ///< cosine (0.8°): so far a lamp turns, and
constexpr float kLampShare = 0.05f;       ///< so much its irradiance changes, before it is looked for again;
constexpr float kLampPlace = 0.01f;       ///< and of its distance, where its tag says that
constexpr int kRigKept = 12;              ///< solves of all after which the rig is checked again
constexpr int kSolvesKept = 8;            ///< solves after which it is, whatever happened
constexpr int kNewSolvesKept = 32;        ///< solves of what is new, after which all is, whatever happened
constexpr double kMostNew = 0.25;         ///< of the surface that may be solved apart from the rest
constexpr float kOtherLight = 0.05f;      ///< and so much of the environment may change meanwhile
constexpr float kGuessed = 0.3f;          ///< of log power; beyond it that is a guess
constexpr float kFarthestKnown_m = 7.5f;  ///< beyond it a lamp is as good as infinitely far

bool is_known(const LampEstimate& estimate) { return !estimate.far && estimate.distance_m < kFarthestKnown_m; }

std::vector<PointLight> placed(const Illumination& illumination, const std::vector<LampEstimate>& estimates) {
  std::vector<PointLight> lights = illumination.lights;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const LampEstimate& estimate = estimates[i];
    PointLight& light = lights[i];
    light.irradiance = light.irradiance.cwiseProduct(estimate.gain);
    if (light.clipped) light.power_log_sigma = estimate.gain_log_sigma;
    if (light.distance_known) {  // by its tag
      light.intensity = light.irradiance * (light.position_m - illumination.probe_position_m).squaredNorm();
      light.flat = estimate.flat;
      light.normal = estimate.normal;
      continue;
    }
    light.distance_known = is_known(estimate);
    if (!light.distance_known) continue;
    light.position_m = illumination.probe_position_m + estimate.distance_m * light.direction;
    light.intensity = light.irradiance * estimate.distance_m * estimate.distance_m;
    light.radius_m = estimate.distance_m * std::tan(light.angular_radius_rad);
    light.distance_log_sigma = estimate.log_sigma;
    light.flat = estimate.flat;
    light.normal = estimate.normal;
  }
  return lights;
}

/// What lamps were when their places were found.
struct Located {
  std::size_t points = 0;
  std::vector<PointLight> lights;
  int solves = 0;

  bool grown(double points_now) const { return points_now > kMoreSurface * static_cast<double>(points); }
  bool holds(const Illumination& illumination) const {
    const std::vector<PointLight>& now = illumination.lights;
    if (now.size() != lights.size()) return false;
    return std::all_of(now.begin(), now.end(), [&](const PointLight& light) {
      const auto was =
          std::find_if(lights.begin(), lights.end(), [&](const PointLight& other) { return other.id == light.id; });
      return was != lights.end() && was->clipped == light.clipped && was->direction.dot(light.direction) > kLampTurn &&
             (was->irradiance - light.irradiance).norm() < kLampShare * was->irradiance.norm() &&
             light.shown == PointLight::Shown::yes && was->distance_known == light.distance_known &&
             (was->position_m - light.position_m).norm() <=
                 kLampPlace * (light.position_m - illumination.probe_position_m).norm();
    });
  }
};

std::string distance_warning(const std::vector<PointLight>& lights) {
  const auto unknown =
      std::count_if(lights.begin(), lights.end(), [](const PointLight& l) { return !l.distance_known; });
  if (unknown == 0) return "";
  return std::to_string(unknown) + (unknown == 1 ? " lamp is" : " lamps are") +
         " taken as infinitely far: the room's shading does not tell the distance";
}

std::string power_warning(const std::vector<PointLight>& lights) {
  const auto guessed =
      std::count_if(lights.begin(), lights.end(), [](const PointLight& l) { return l.power_log_sigma > kGuessed; });
  if (guessed == 0) return "";
  return "the power of " + std::to_string(guessed) + (guessed == 1 ? " clipped lamp" : " clipped lamps") +
         " is a guess: neither white paper nor shadows tell it, and surfaces may be lighter or darker than found";
}

std::string beam_warning(const std::vector<LampEstimate>& estimates) {
  const auto beams =
      std::count_if(estimates.begin(), estimates.end(), [](const LampEstimate& estimate) { return estimate.beam; });
  if (beams == 0) return "";
  return std::to_string(beams) + (beams == 1 ? " lamp sends a beam: it is" : " lamps send beams: they are") +
         " drawn as a panel, and may stand farther away; a tag on it would tell";
}

/// Of the environment: what changed over all of it.
float other_light(const EnvironmentMap& now, const EnvironmentMap& before) {
  if (now.radiance.data.size() != before.radiance.data.size()) return 1;
  double change = 0, sum = 0;
  for (std::size_t i = 0; i < now.radiance.data.size(); ++i) {
    change += std::abs(now.radiance.data[i] - before.radiance.data[i]);
    sum += before.radiance.data[i];
  }
  return static_cast<float>(change / std::max(sum, 1e-12));
}

constexpr const char* kNoSurface =
    "no surface of the room is known: the depth pictures hold no measurements, or none within reach";

std::string rig_warning(const ExtrinsicsError& error) {
  char line[160];
  std::snprintf(line, sizeof line,
                "the fish-eye does not stand as T_tag_fisheye says: turned by about %.0f degrees and moved by about "
                "%.0f cm it would see what the colour camera saw",
                error.turn_degrees, 100 * error.shift_m);
  return line;
}

}  // namespace

struct AlbedoStage::State {
  explicit State(const capture::Session& session)
      : metal(session), fisheye(session.fisheye), tag_size_m(session.tag.size_m), marked(session.lamps) {}

  std::vector<LampEstimate> locate(const IrradianceModel& room, const Illumination& illumination,
                                   const Surface& surface, const std::vector<Eigen::Vector3f>& gathered);

  /// Where lamps and most of the room are as they were: what is new solved with the rest as it is. Empty where
  /// everything is to be solved.
  std::optional<Result> solve_new(const DistanceField& field, const Illumination& illumination, bool even_if_due);
  void add_warnings(const Illumination& lit);

  /// Looks again when so much more of the room is known.
  void check_rig(const DistanceField& field, const FieldRays& rays, const Illumination& illumination,
                 std::size_t points);

  MetalMask metal;
  std::optional<capture::FisheyeCamera> fisheye;
  int rig_solves = 0;          ///< since it was
  std::size_t rig_points = 0;  ///< how much surface was known when the rig was last checked
  std::string rig_found;       ///< empty where it agrees
  double tag_size_m;
  std::vector<capture::TaggedLamp> marked;
  std::uint64_t version = 0;
  bool solved = false;
  std::uint64_t field_version = 0, illumination_version = 0;
  Result last;
  std::map<int, LampEstimate> estimates;  ///< by the lamp's id
  std::size_t searched_points = 0;        ///< how much surface was known when lamps were last searched from nothing
  LampFilter filter;
  Located located;
  std::vector<PointLight> last_lamps;  ///< as they were placed
  float sample_m = 0;                  ///< cells only grow, so that samples stay what they were
  GatherCache memory;
  EnclosureStage enclosure;
  std::shared_ptr<const Enclosure> closed;  ///< what `memory` was gathered in,
  bool rough = false;                       ///< and whether with few rays
  IncrementalSolver known;
  bool empty = false;                     ///< no surface is known
  IrradianceModel::Beyond beyond;         ///< as everything was solved with,
  std::vector<Eigen::Vector3f> on_floor;  ///< what lamps made of the floor that nobody saw,
  EnvironmentMap environment;             ///< and the environment as it was measured
};

std::vector<LampEstimate> AlbedoStage::State::locate(const IrradianceModel& room, const Illumination& illumination,
                                                     const Surface& surface,
                                                     const std::vector<Eigen::Vector3f>& gathered) {
  const std::size_t points = surface.points.size();
  std::vector<LampEstimate> result;
  if (located.solves < kSolvesKept && !located.grown(static_cast<double>(points)) && located.holds(illumination)) {
    ++located.solves;
    for (const PointLight& light : illumination.lights) result.push_back(estimates.at(light.id));
    return result;
  }
  if (static_cast<double>(points) > kGrown * static_cast<double>(searched_points)) {
    estimates.clear();
    searched_points = points;
  }
  std::vector<std::optional<LampEstimate>> before;
  for (const PointLight& light : illumination.lights) {
    const auto estimate = estimates.find(light.id);
    before.push_back(estimate == estimates.end() ? std::nullopt : std::optional(estimate->second));
  }
  const LampSolution found =
      locate_lamps(room, illumination, surface.samples, gathered, tag_paper(surface.points, tag_size_m), before,
                   rough ? Search::rough : Search::fine);
  result = rough ? found.lamps : filter.combine(illumination.lights, found);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const PointLight& light = illumination.lights[i];
    if (!light.distance_known) continue;
    result[i].distance_m = (light.position_m - illumination.probe_position_m).norm();
    result[i].log_sigma = light.distance_log_sigma;
    if (!light.flat) continue;
    result[i].flat = true;
    result[i].normal = light.normal;
  }
  estimates.clear();
  for (std::size_t i = 0; i < result.size(); ++i) estimates[illumination.lights[i].id] = result[i];
  located = {points, illumination.lights, 0};
  return result;
}

void AlbedoStage::State::check_rig(const DistanceField& field, const FieldRays& rays, const Illumination& illumination,
                                   std::size_t points) {
  const bool hidden = std::any_of(illumination.lights.begin(), illumination.lights.end(),
                                  [](const PointLight& light) { return light.hidden > 0; });
  const bool grown = static_cast<double>(points) > kGrown * static_cast<double>(rig_points);
  if (fisheye && !hidden && (grown || ++rig_solves >= kRigKept)) {
    rig_points = points;
    rig_solves = 0;
    const std::optional<ExtrinsicsError> error = rig_error(field, rays, metal, illumination, *fisheye);
    rig_found = error ? rig_warning(*error) : "";
  }
}

AlbedoStage::AlbedoStage(const capture::Session& session) : state_(std::make_unique<State>(session)) {}
AlbedoStage::~AlbedoStage() = default;

std::optional<AlbedoStage::Result> AlbedoStage::State::solve_new(const DistanceField& field,
                                                                 const Illumination& illumination, bool even_if_due) {
  if (!solved) return std::nullopt;
  if (field_version == field.version && illumination_version == illumination.version) return last;
  if (other_light(illumination.environment, environment) > kOtherLight) return std::nullopt;
  const IncrementalSolver::Change change = known.change(field);
  const bool due = change.share > kMostNew || located.grown(change.points) || located.solves >= kNewSolvesKept;
  if (due && !even_if_due) return std::nullopt;
  const FieldRays rays(field);
  auto lit = std::make_shared<Illumination>(without_reflections(illumination, field, rays));
  const OutOfViewLamps unseen(*lit, rays);
  Illumination joined = *lit;
  joined.lights = join_pieces(lit->lights);
  if (!located.holds(joined)) return std::nullopt;
  ++located.solves;
  std::vector<LampEstimate> lamps;
  for (const PointLight& light : joined.lights) lamps.push_back(estimates.at(light.id));
  if (illumination.version != illumination_version) {
    last_lamps = placed(joined, lamps);
    raise_clipped(*lit, last_lamps, closed.get(), field, rays, metal);
    lit->lights = place_pieces(lit->lights, joined.lights, last_lamps, lit->probe_position_m);
    last.warnings.clear();
    unseen.settle(*lit, marked, last.warnings);
    add_warnings(*lit);
    last.illumination = lit;
  }
  last.whole = false;
  last.due = due;
  const IrradianceModel room(field, rays, metal, closed.get(), beyond);
  auto albedo = std::make_shared<AlbedoField>(*last.albedo);
  last.samples =
      known.solve(field, rays, metal, {room, *last.illumination, on_floor, kGatherRays}, change, albedo->bricks);
  if (!change.bricks.empty()) {
    albedo->version = ++version;
    last.albedo = albedo;
  }
  field_version = field.version;
  illumination_version = illumination.version;
  return last;
}

void AlbedoStage::State::add_warnings(const Illumination& lit) {
  if (empty) last.warnings.push_back(kNoSurface);
  std::vector<LampEstimate> lamps;
  for (const auto& [id, estimate] : estimates) lamps.push_back(estimate);
  for (const std::string& warning :
       {distance_warning(lit.lights), beam_warning(lamps), power_warning(lit.lights), rig_found})
    if (!warning.empty()) last.warnings.push_back(warning);
}

std::optional<AlbedoStage::Result> AlbedoStage::solve_new(const DistanceField& field,
                                                          const Illumination& illumination) {
  return state_->solve_new(field, illumination, true);
}

AlbedoStage::Result AlbedoStage::solve(const DistanceField& field, const Illumination& illumination) {
  State& s = *state_;
  const std::optional<Result> result = s.solve_new(field, illumination, false);
  return result ? *result : solve_all(field, illumination);
}

AlbedoStage::Result AlbedoStage::solve_all(const DistanceField& field, const Illumination& illumination) {
  State& s = *state_;

  const FieldRays rays(field);
  auto lit = std::make_shared<Illumination>(without_reflections(illumination, field, rays));
  const OutOfViewLamps unseen(*lit, rays);
  Surface surface = find_surface(field, rays, s.metal, kSamples, s.sample_m);
  s.sample_m = surface.sample_m;
  const std::vector<RoomPoint> known_points = room_points(field);
  Illumination whole = *lit;
  whole.lights = join_pieces(lit->lights);
  std::optional<IrradianceModel> room;
  std::vector<Eigen::Vector3f> gathered(surface.samples.size());
  std::vector<bool> smooth;  // and no print, which is black and white
  for (const SurfaceSample& sample : surface.samples) smooth.push_back(sample.usable && !on_tag(sample, s.tag_size_m));
  bool first = s.last_lamps.empty();
  std::vector<PointLight> lamps = first ? whole.lights : s.last_lamps;
  for (;;) {
    Illumination placed_light = *lit;
    placed_light.lights = lamps;
    const std::shared_ptr<const Enclosure> closed = s.enclosure.close(field, known_points, placed_light);
    if (!first) raise_clipped(*lit, lamps, closed.get(), field, rays, s.metal);
    if (closed != s.closed || s.rough) s.memory.forget();
    s.closed = closed;
    s.rough = first && closed;  // then there is a second round
    room.emplace(field, rays, s.metal, *lit, closed.get());
    const std::vector<IrradianceModel::Gathered> light =
        s.memory.gather(*room, *lit, surface.samples, surface.points.size(), s.rough ? kRoughRays : kGatherRays);
    const auto add_floor = [&] {
      s.on_floor = room->light_on_floor(lamps);
      for (std::size_t i = 0; i < light.size(); ++i)
        gathered[i] = light[i].irradiance + room->by_floor(light[i], s.on_floor);
    };
    bool floor = false;
    for (std::size_t i = 0; i < light.size(); ++i) {
      surface.samples[i].usable = smooth[i] && light[i].metal_share < kMostMetal;
      floor |= !light[i].on_floor.empty();
    }
    add_floor();
    lamps = placed(whole, s.locate(*room, whole, surface, gathered));
    if (floor) add_floor();
    // What closes the room, and what a floor that nobody saw sends back, hang on where lamps are: at first these are
    // found roughly, then again.
    if (!first || !(floor || closed || !lit->environment.clipped.empty())) break;
    first = false;
    s.located = {};
  }
  s.last_lamps = lamps;
  lit->lights = place_pieces(lit->lights, whole.lights, lamps, lit->probe_position_m);
  std::vector<std::string> warnings;
  unseen.settle(*lit, s.marked, warnings);

  const float dark = dark_radiance(surface.samples);
  const LitSurface points(surface, *room, *lit, gathered, dark);
  const std::vector<SampleAlbedo> albedo =
      solve_albedo(surface.samples, points.sample_light(), points.neighbours(), dark);
  const std::vector<PointAlbedo> of_points = points.albedo(albedo);
  auto result = std::make_shared<AlbedoField>();
  result->voxel_m = field.voxel_m;
  result->version = ++s.version;
  result->bricks = albedo_bricks(surface.points, of_points);
  if (s.last.albedo) keep_unchanged(result->bricks, s.last.albedo->bricks);

  s.known.keep(field, surface, gathered, albedo, of_points, dark);
  s.beyond = room->beyond();
  s.environment = illumination.environment;
  s.last = {result, lit, std::move(warnings), true, false, surface.samples.size()};
  s.empty = surface.points.empty();
  s.check_rig(field, rays, illumination, surface.points.size());
  s.add_warnings(*lit);
  s.solved = true;
  s.field_version = field.version;
  s.illumination_version = illumination.version;
  return s.last;
}

}  // namespace lumigraft::reconstruct
