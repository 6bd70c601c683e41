#include "reconstruct/scene_builder.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <utility>

#include "capture/message_text.h"
#include "capture/sync/depth_registration.h"
#include "reconstruct/albedo/kept_albedo.h"
#include "reconstruct/albedo/parameters.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/kept_room/room_check.h"
#include "reconstruct/lamps/light_from_shading.h"
#include "reconstruct/lamps/seen_lamps.h"
#include "reconstruct/light/fluence.h"
#include "reconstruct/light/light.h"
#include "reconstruct/pose/lamp_tags.h"
#include "reconstruct/pose/pose.h"
#include "reconstruct/room/enclosure.h"
#include "reconstruct/room/frozen_depth.h"
#include "reconstruct/room/mirror_detection.h"
#include "reconstruct/room/tag_planes.h"

namespace lumigraft::reconstruct {
namespace {

/// Runs a stage and records its cost; its exception becomes a warning. `function` returns whether there was work.
template <typename Function>
void run_if_due(BuildResult& built, const std::string& name, Function function) {
  const CostClock clock;
  try {
    if (!function()) return;
  } catch (const std::exception& e) {
    append_warnings(built.warnings, {name + ": " + e.what()});
  }
  built.stages[name] = clock.elapsed();
}

template <typename Function>
void run_stage(BuildResult& built, const std::string& name, Function function) {
  run_if_due(built, name, [&] {
    function();
    return true;
  });
}

/// A value that one stage writes and another reads, which may run at the same time.
template <typename Value>
class Shared {
 public:
  void put(Value value) {
    std::lock_guard lock(mutex_);
    value_ = std::move(value);
  }
  Value get() {
    std::lock_guard lock(mutex_);
    return value_;
  }
  Value take() {
    std::lock_guard lock(mutex_);
    return std::exchange(value_, {});
  }

 private:
  std::mutex mutex_;
  Value value_;
};

struct LampTags {
  std::vector<LampTagPose> poses;
  std::int64_t time_ns = 0;
};

/// Time of fusion without any image of a configured fish-eye, after which light is estimated without one: twice the
/// difference of times at which images still belong together. A later image replaces the estimate.
constexpr std::int64_t kFisheyeAwaited_ns = 500'000'000;

/// Within this time fusion forgets what it sees gone, and the shadows of that.
constexpr std::int64_t kDisturbed_ns = 1'000'000'000;
constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::min() / 2;

/// Of the brightest irradiance so far: colours of surface follow the light down to it, and are there again when the
/// light of a black room is.
constexpr float kNoLight = 1e-6f;

/// Ratio of the light at the fish-eye, from which on it may see a lamp that was hidden: in the middle between no change
/// and the least that was missing, on a scale on which errors of both are as large.
const float kCompletedLight = std::sqrt(kAlbedoParameters.missing_light.max_reflected);

constexpr const char* kKeptRoomUnseen =
    "the room that was kept is not used yet, nor is this one kept: the camera sees too little of its surfaces; if the "
    "camera was moved for good, delete the file";

}  // namespace

struct SceneBuilder::State {
  SceneOverrides overrides;
  capture::RegistrationStage registration;
  FrozenDepth frozen_depth;
  PoseStage pose;
  bool located = false;             ///< in any frame so far
  const std::string never_located;  ///< warning until then
  LampTagStage lamp_tags;
  TagPlanes tag_planes;
  LightStage light;
  ColorGainStage color_gain;
  std::atomic<float> color_brightness = 1;  ///< newest gain, mean of the channels
  std::atomic<bool> color_shows_room = true;
  std::atomic<float> color_correction = 0;  ///< ColorGainStage::Result::correction, since radiance was last fused
  FusionStage fusion;
  std::shared_ptr<const Illumination> fused_light;  ///< as measured when it last changed while radiance was fused
  std::shared_ptr<const Illumination> lit_then;     ///< the same light, with what is known of its lamps now
  float brightest = 1e-9f;                          ///< mean irradiance at the fish-eye so far, W/m²
  AlbedoStage albedo;
  EnclosureStage enclosure;
  LightFromShading light_from_shading;
  SeenLamps seen_lamps;
  Shared<std::shared_ptr<const Illumination>> incomplete_light;  ///< that the fish-eye measured; or null
  const std::int64_t fisheye_awaited_ns;
  std::int64_t first_fused_ns = -1;
  std::atomic<std::int64_t> fused_span_ns = 0;  ///< time over which depth was fused
  AlbedoSchedule schedule;
  std::atomic<std::int64_t> newest_ns = 0, disturbed_ns = kNever_ns;  ///< frames; the last in which a shadow moved
  std::atomic<bool> learning = true;
  Shared<std::optional<TagMap::State>> newest_tag_map;     ///< until it is taken
  Shared<std::optional<KeyframeMap::Views>> newest_views;  ///< the same
  std::optional<KeptRoom> kept_room;                       ///< until it is used or found to be another one
  RoomCheck room_check;
  Shared<std::shared_ptr<const AlbedoField>> restored_albedo;   ///< of that room, until albedo is solved with it
  Shared<std::vector<KeptLamp>> restored_lamps, lamps_to_keep;  ///< the former until lamps are solved with them
  std::optional<KeptAlbedo> kept_albedo;
  std::atomic<bool> room_is_certain = true, restored_another = false;
  std::uint64_t taken_version = 0;  ///< of the field that room_to_keep returned last
  Shared<LampTags> newest_lamp_tags;
  Shared<SeenByColor> seen_by_color;  ///< until the light stage takes it
  SceneStore store;

  State(const capture::Session& session, SceneOverrides the_overrides, std::unique_ptr<AlbedoPace> pace,
        const FusionSettings& fusion_settings)
      : overrides(std::move(the_overrides)),
        registration(session),
        pose(session.tag, session.color.model, session.color.response, session.depth_noise(), session.color.readout_s),
        never_located(session.tag.present()
                          ? session.tag.family + " " + std::to_string(session.tag.id) +
                                ": not seen since the start; objects are shown once it is in the colour camera's view"
                          : "no tag and no level surface seen since the start; objects are shown once depth has one"),
        lamp_tags(session),
        tag_planes(session),
        light(session),
        color_gain(session),
        fusion(session, fusion_settings),
        albedo(session),
        light_from_shading(session),
        fisheye_awaited_ns(session.fisheye ? kFisheyeAwaited_ns : 0),
        schedule(std::move(pace)),
        room_check(session.color.model, session.depth_noise()) {}

  std::optional<AlbedoStage::Result> solve(AlbedoWork work, const std::shared_ptr<const DistanceField>& field,
                                           const Illumination& measured);
  void compare_kept_room(const capture::FrameSet& frame, const Pose& where);
  void use_kept_solution();
  void estimate_light(const DistanceField& field);
  bool is_incomplete(const Illumination& measured);
  void publish(AlbedoStage::Result solution, const DistanceField& field,
               const std::shared_ptr<const Illumination>& measured);
};

SceneBuilder::SceneBuilder(const capture::Session& session, SceneOverrides overrides,
                           std::unique_ptr<AlbedoPace> albedo_pace, const FusionSettings& fusion)
    : state_(std::make_unique<State>(session, std::move(overrides), std::move(albedo_pace), fusion)) {}

SceneBuilder::~SceneBuilder() = default;

bool SceneBuilder::learning() const { return state_->learning; }
FusionStage::Memory SceneBuilder::fusion_memory() const { return state_->fusion.memory(); }
int SceneBuilder::albedo_patience() const { return state_->schedule.patience(); }
SceneStore& SceneBuilder::store() { return state_->store; }
const SceneStore& SceneBuilder::store() const { return state_->store; }

capture::FrameSet SceneBuilder::register_depth(const capture::FrameSet& sensed) {
  State& s = *state_;
  capture::FrameSet registered = s.frozen_depth.check(s.registration.register_depth(sensed));
  s.store.publish_warnings("frozen depth", s.frozen_depth.warnings());
  return registered;
}

PoseStage::Result SceneBuilder::locate_camera(const capture::FrameSet& frame) {
  State& s = *state_;
  if (s.overrides.pose) return {s.overrides.pose(frame), {}};
  PoseStage::Result result = s.pose.locate(frame, s.store.observed_field().get());
  if (auto learnt = s.pose.take_tag_map()) s.newest_tag_map.put(std::move(learnt));
  if (auto views = s.pose.take_views()) s.newest_views.put(std::move(views));
  if (!s.located) {
    s.located = result.pose.has_value();
    s.store.publish_warnings("tag", s.located ? std::vector<std::string>{} : std::vector{s.never_located});
  }
  return result;
}

void SceneBuilder::restore_tag_map(TagMap::State learnt) { state_->pose.restore_tag_map(std::move(learnt)); }
void SceneBuilder::restore_views(KeyframeMap::Views views) { state_->pose.restore_views(std::move(views)); }
std::optional<KeyframeMap::Views> SceneBuilder::take_views() { return state_->newest_views.take(); }

void SceneBuilder::restore_room(KeptRoom kept) {
  if (kept.field.bricks.empty()) return;
  state_->kept_room = std::move(kept);
  state_->room_is_certain = false;
}

std::optional<RoomToKeep> SceneBuilder::room_to_keep() {
  State& s = *state_;
  const std::shared_ptr<const DistanceField> field = s.store.observed_field();
  if (!s.room_is_certain || !field || field->bricks.empty() || field->version == s.taken_version) return std::nullopt;
  s.taken_version = field->version;
  s.store.publish_warnings("kept room", {});
  RoomToKeep result{.room = {.field = *field, .albedo = nullptr, .albedo_error = 0, .lamps = {}},
                    .another = s.restored_another};
  result.room.lamps = s.lamps_to_keep.get();
  // What was solved in a guessed light is no knowledge.
  if (const Scene scene = s.store.newest(); scene.illumination && !scene.illumination->from_shading) {
    result.room.albedo = scene.albedo;
    result.room.albedo_error = common_error(*scene.illumination);
  }
  return result;
}

std::optional<TagMap::State> SceneBuilder::take_tag_map() { return state_->newest_tag_map.take(); }
void SceneBuilder::restart_tracking() { state_->pose.reset(); }

LampTagStage::Result SceneBuilder::locate_lamp_tags(const capture::FrameSet& frame, const std::optional<Pose>& pose) {
  State& s = *state_;
  LampTagStage::Result found = s.lamp_tags.locate(frame, pose);
  s.newest_lamp_tags.put({found.marks, frame.time_ns});
  s.store.publish_warnings("lamp tags", found.warnings);
  return found;
}

void SceneBuilder::extract_light(const capture::FisheyeFrames& fisheye, const capture::Frame* color) {
  State& s = *state_;
  s.light.resolve(s.seen_by_color.take());
  LampTags tags = s.newest_lamp_tags.get();
  // The colour camera may be disconnected: then for as long as a hidden tag's pose is kept.
  if (!fisheye.empty() && fisheye.front()->stamp.time_ns - tags.time_ns > LampTagStage::kHeldNs) tags.poses.clear();
  LightStage::Result result = s.light.extract(fisheye, color, tags.poses, s.color_brightness);
  if (result.illumination && s.is_incomplete(*result.illumination))
    result.warnings.emplace_back(kLightIsHidden);
  else if (result.illumination)
    s.store.publish_light(std::move(result.illumination));
  else if (s.store.measured_light())
    std::replace(result.warnings.begin(), result.warnings.end(), std::string(kLightUnknown),
                 std::string(kLightFromShading));
  s.store.publish_warnings("light", std::move(result.warnings));
}

ColorGainStage::Result SceneBuilder::estimate_color_gain(const capture::FrameSet& frame,
                                                         const std::optional<Pose>& pose) {
  State& s = *state_;
  std::shared_ptr<const Illumination> light = s.store.newest().illumination;
  if (light && light->from_shading) light = nullptr;  // it changes as more of the room is known
  ColorGainStage::Result result = s.color_gain.estimate(frame, pose, light);
  s.color_brightness = result.gain.mean();
  s.color_shows_room = result.shows_room;
  if (result.correction > 0) s.color_correction = result.correction;
  s.seen_by_color.put(result.light);
  s.newest_ns = frame.time_ns;
  if (result.shadows) s.disturbed_ns = frame.time_ns;
  s.store.publish_shadows(result.shadows);
  return result;
}

capture::FrameSet SceneBuilder::complete_depth(const capture::FrameSet& frame, const std::optional<Pose>& pose) {
  State& s = *state_;
  capture::FrameSet completed = s.tag_planes.complete(frame, pose);
  s.store.publish_warnings("depth", s.tag_planes.warnings());
  return completed;
}

void SceneBuilder::State::compare_kept_room(const capture::FrameSet& frame, const Pose& where) {
  if (!kept_room || !frame.depth || where.age_ns != 0) return;
  const RoomCheck::Verdict verdict =
      room_check.look(kept_room->field, frame.depth->depth_m, where.T_tag_camera.cast<float>(), frame.time_ns);
  std::vector<std::string> warnings;
  if (verdict == RoomCheck::Verdict::undecided) {
    if (room_check.sees_too_little()) warnings.emplace_back(kKeptRoomUnseen);
  } else if (verdict == RoomCheck::Verdict::another) {
    const RoomCheck::Points points = room_check.points();
    warnings.push_back(capture::formatted(
        "the room that was kept is another one, or its tag was moved: %d of %d points that the camera sees are on its "
        "surfaces, allowed: more than half; it is not used, and its file is renamed when this room is kept",
        points.on_surface, points.all()));
    restored_another = true;
  } else {
    fusion.restore(std::move(kept_room->field));
    restored_albedo.put(kept_room->albedo);
    restored_lamps.put(kept_room->lamps);
    lamps_to_keep.put(std::move(kept_room->lamps));
  }
  store.publish_warnings("kept room", std::move(warnings));
  if (verdict == RoomCheck::Verdict::undecided) return;
  kept_room.reset();
  room_is_certain = true;
}

void SceneBuilder::fuse_depth(const capture::FrameSet& frame, const Pose& pose) {
  State& s = *state_;
  s.compare_kept_room(frame, pose);
  double light_change = 0;
  if (const auto light = s.store.measured_light(); light && !light->from_shading && light != s.fused_light) {
    if (s.fused_light) light_change = relative_change(*light, *s.fused_light);
    // Smaller ones are noise of the fish-eye's image, and would accumulate.
    if (s.fused_light && light_change < AlbedoSchedule::kLittle)
      light_change = 0;
    else
      s.fused_light = light;
  }
  const double change = std::max<double>(light_change, s.color_correction.exchange(0));
  const std::shared_ptr<const Illumination> now = s.store.newest().illumination, then = s.lit_then;
  const auto light_ratio = [&](const Eigen::Vector3f& position_m) -> Eigen::Array3f {
    const float no_light = kNoLight * s.brightest;
    return mean_irradiance(*now, position_m).max(no_light) / mean_irradiance(*then, position_m).max(no_light);
  };
  const bool follow = light_change > 0 && now && then;
  if (now) s.brightest = std::max(s.brightest, mean_irradiance(*now, now->probe_position_m).mean());
  s.store.publish_field(follow ? s.fusion.fuse(frame, pose, change, light_ratio) : s.fusion.fuse(frame, pose, change));
  if (follow || !then || s.store.measured_light() == s.fused_light) s.lit_then = now;
  if (s.first_fused_ns < 0) s.first_fused_ns = frame.time_ns;
  s.fused_span_ns = frame.time_ns - s.first_fused_ns;
  s.store.publish_warnings("geometry", s.fusion.warnings());
}

void SceneBuilder::State::use_kept_solution() {
  if (std::vector<KeptLamp> lamps = restored_lamps.take(); !lamps.empty()) albedo.restore_lamps(std::move(lamps));
  const std::shared_ptr<const AlbedoField> kept = restored_albedo.take();
  if (!kept) return;
  kept_albedo.emplace(kept);
  store.publish_albedo(kept_albedo->complete(store.newest().albedo));
}

/// Whether most of the room's light is still missing from what the fish-eye measures; forgets it otherwise.
bool SceneBuilder::State::is_incomplete(const Illumination& measured) {
  const std::shared_ptr<const Illumination> incomplete = incomplete_light.get();
  const auto at_probe = [](const Illumination& seen) { return mean_irradiance(seen, seen.probe_position_m).mean(); };
  if (incomplete && at_probe(measured) < kCompletedLight * at_probe(*incomplete)) return true;
  incomplete_light.put(nullptr);
  return false;
}

/// While no fish-eye delivers, or not the light of the room.
void SceneBuilder::State::estimate_light(const DistanceField& field) {
  const std::shared_ptr<const Illumination> known = store.measured_light();
  const bool awaited = fused_span_ns < fisheye_awaited_ns && !incomplete_light.get();
  if (overrides.light || (known && !known->from_shading) || awaited) return;
  const std::shared_ptr<const Illumination> estimated = light_from_shading.estimate(field);
  if (!estimated) return;
  if (!known && !incomplete_light.get()) store.publish_warnings("light", {kLightFromShading});
  store.publish_light(estimated);
}

/// Empty if only a solution of everything is valid and its wait is not over.
std::optional<AlbedoStage::Result> SceneBuilder::State::solve(AlbedoWork work,
                                                              const std::shared_ptr<const DistanceField>& field,
                                                              const Illumination& measured) {
  const bool held = newest_ns - disturbed_ns < kDisturbed_ns;
  albedo.hold(held);
  const bool may_solve_everything = schedule.may_solve_everything();
  schedule.begin(field, measured);
  if (work == AlbedoWork::incremental || held) {
    const AlbedoSchedule::Work at_work(schedule, AlbedoWork::incremental);
    if (auto solution = albedo.solve_incremental(*field, measured, held || !may_solve_everything)) return solution;
    if (auto solution = albedo.follow_light(*field, measured)) return solution;
    if (!may_solve_everything) {
      schedule.wait_for_everything();
      return std::nullopt;
    }
  }
  const AlbedoSchedule::Work at_work(schedule, AlbedoWork::everything);
  if (auto solution = albedo.follow_light(*field, measured)) return solution;
  return albedo.solve_complete(*field, measured);
}

void SceneBuilder::State::publish(AlbedoStage::Result solution, const DistanceField& field,
                                  const std::shared_ptr<const Illumination>& measured) {
  if (overrides.light) solution.illumination = measured;
  if (kept_albedo && solution.albedo) solution.albedo = kept_albedo->complete(solution.albedo);
  if (solution.complete && solution.illumination) {
    const Illumination& lit = *solution.illumination;
    const std::shared_ptr<const Enclosure> known = overrides.enclosure ? overrides.enclosure(lit) : nullptr;
    const std::vector<RoomPoint> points = room_points(field);
    store.publish_enclosure(known ? known : enclosure.close(field, points, lit));
    store.publish_warnings("mirrors", mirror_warnings(points, field, solution.mirrors));
  }
  store.publish_solution(std::move(solution), field.version, measured);
}

bool SceneBuilder::solve_albedo() {
  State& s = *state_;
  s.use_kept_solution();
  if (!s.color_shows_room) return false;
  std::shared_ptr<const DistanceField> field = s.store.room_field();
  if (field) s.estimate_light(*field);
  std::shared_ptr<const Illumination> measured = s.store.measured_light();
  if (!field || !measured) return false;
  const AlbedoWork work = s.schedule.next(*field, *measured);
  s.learning = s.schedule.learning();
  if (work == AlbedoWork::nothing) return false;
  SeenLamps::Result seen = s.seen_lamps.find(*s.store.observed_field(), measured);
  measured = std::move(seen.light);
  s.store.publish_lamp_surface(std::move(seen.surface));
  field = s.store.room_field();
  std::optional<AlbedoStage::Result> solution = s.solve(work, field, *measured);
  if (!solution) return false;
  if (solution->light_is_missing && !s.overrides.light) {
    s.incomplete_light.put(measured);
    s.store.publish_warnings("light", {kLightIsHidden});
    s.store.withdraw_light();
    s.estimate_light(*field);
    return true;
  }
  s.schedule.solved(solution->albedo, solution->due);
  s.lamps_to_keep.put(s.albedo.lamps_to_keep());
  s.publish(*std::move(solution), *field, measured);
  return true;
}

BuildResult SceneBuilder::build(const capture::FrameSet& sensed) {
  State& s = *state_;
  BuildResult built;
  std::optional<Pose> pose;
  append_warnings(built.warnings, sensed.warnings);
  built.frame = sensed;
  run_stage(built, "register depth", [&] { built.frame = register_depth(sensed); });
  if (s.overrides.frame) built.frame = s.overrides.frame(built.frame);
  const capture::FrameSet& frame = built.frame;

  run_stage(built, "pose", [&] {
    PoseStage::Result result = locate_camera(frame);
    pose = result.pose;
    append_warnings(built.warnings, result.warnings);
  });
  run_stage(built, "light", [&] {
    if (s.overrides.light) {
      s.store.publish_light(s.overrides.light(frame));
      return;
    }
    append_warnings(built.warnings, locate_lamp_tags(frame, pose).warnings);
    extract_light(frame.fisheye, frame.color.get());
  });
  run_stage(built, "complete depth", [&] { built.frame = complete_depth(frame, pose); });
  run_stage(built, "color gain", [&] {
    ColorGainStage::Result result = estimate_color_gain(frame, pose);
    built.frame.color_gain = {result.gain[0], result.gain[1], result.gain[2]};
    built.frame.color_vignetting = result.vignetting;
    built.frame.color_shows_room = result.shows_room;
    append_warnings(built.warnings, result.warnings);
    if (!s.overrides.light && (!result.light.off.empty() || result.light.dimming)) extract_light({}, nullptr);
  });
  if (pose && frame.depth) run_stage(built, "fuse", [&] { fuse_depth(frame, *pose); });
  run_if_due(built, "albedo", [&] { return solve_albedo(); });
  if (const auto field = s.store.newest().field; s.overrides.albedo && pose && field) {
    run_stage(built, "true albedo", [&] { s.store.publish_albedo(s.overrides.albedo(frame, *pose, *field)); });
  }

  built.scene = s.store.newest();
  built.scene.pose = pose;
  append_warnings(built.warnings, built.scene.warnings);
  return built;
}

}  // namespace lumigraft::reconstruct
