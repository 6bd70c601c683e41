#include "server/pipeline/pipeline.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "reconstruct/scene_builder.h"
#include "relight/planner.h"
#include "server/pipeline/audience.h"
#include "server/pipeline/background_threads.h"
#include "server/pipeline/exhibit_loader.h"
#include "server/pipeline/frame_player.h"
#include "server/pipeline/heartbeats.h"
#include "server/pipeline/mailbox.h"
#include "server/pipeline/map_drawer.h"
#include "server/pipeline/pacing.h"
#include "server/pipeline/resting_pace.h"
#include "server/pipeline/room_keeper.h"
#include "server/pipeline/surface_picking.h"

namespace lumigraft::server {
namespace {

using Clock = std::chrono::steady_clock;

struct PosedFrame {
  PlayedFrame played;       ///< with depth as measured
  Clock::time_point begun;  ///< when this stage took it
  reconstruct::PoseStage::Result located;
  capture::FrameSet completed;  ///< the same frame: SceneBuilder::complete_depth, with the colour gain
};

/// Input of the light stage.
struct FisheyeView {
  capture::FisheyeFrames frames;
  std::shared_ptr<const capture::Frame> color;  ///< captured within moment_ns; may be null
};

}  // namespace

struct Pipeline::State {
  const capture::Session session;
  ExhibitState exhibit;
  OpenCameras open_again;
  FramePlayer frames;
  const std::unique_ptr<capture::FisheyeReader> fisheye;
  Playback playback;
  EncoderDemand& demand;
  Metrics& metrics;
  Publish publish;

  Audience audience{demand, Clock::now()};
  reconstruct::SceneBuilder builder;
  reconstruct::SceneStore& store = builder.store();
  relight::Planner planner;
  LiveRelighter relighter;
  ExhibitLoader exhibit_loader;
  relight::Standing standing;
  EncodeStage encode;

  Mailbox<PlayedFrame> to_pose{"pose"};
  Mailbox<std::shared_ptr<const PosedFrame>> to_relight{"relight"};
  std::atomic<bool> pose_waits_for_relight = false;
  LatencyScheduler just_in_time;
  Mailbox<std::shared_ptr<const PosedFrame>> to_geometry{"fuse"};
  Mailbox<std::shared_ptr<const PosedFrame>> to_lamp_tags{"lamp tags"};
  Mailbox<FisheyeView> to_light{"light"};
  Mailbox<ShownFrame> to_encode{"encode"};
  DutyCycle geometry_rest{kPipeline.geometry_every}, lamp_tags_rest{kPipeline.light_every},
      light_rest{kPipeline.light_every}, room_rest{kPipeline.room_every};

  mutable std::mutex newest_mutex;
  ShownFrame newest;
  Record newest_record;
  reconstruct::Scene newest_scene;                      ///< with its pose
  std::shared_ptr<const capture::Frame> newest_camera;  ///< the camera's frame of `newest`
  std::vector<std::string> faults;                      ///< current faults of the cameras

  std::mutex newest_color_mutex;
  std::shared_ptr<const capture::Frame> newest_color;  ///< the last frame of capture

  MapDrawer maps{session.color.model, metrics};
  RoomKeeper room_keeper;

  Clock::time_point last_encoded{};  ///< used by the encode thread only, and so is
  bool encoded_for_viewers = false;  ///< this
  Clock::time_point posed_at{};      ///< used by the pose thread only, and so is
  Clock::time_point shown_at{};      ///< this: the pose of the last frame that was to become a picture

  Heartbeats heartbeats;  ///< of the threads from camera to picture
  std::stop_source stopping;
  BackgroundThreads background_threads;
  std::vector<std::jthread> threads;

  State(ServiceInput input, Cameras cameras, OpenCameras the_open_again, LiveRelighter::MakeDevice make_device,
        EncoderDemand& the_demand, Metrics& the_metrics, Publish the_publish, Keep the_keep)
      : session(input.session),
        exhibit(std::move(input.exhibit), input.limits),
        open_again(std::move(the_open_again)),
        frames(std::move(cameras.frames)),
        fisheye(std::move(cameras.fisheye)),
        demand(the_demand),
        metrics(the_metrics),
        publish(std::move(the_publish)),
        builder(session, {}, std::make_unique<RestingPace>(the_metrics, audience), input.server.fusion),
        planner(input.plan),
        relighter(session, input.plan, std::move(make_device)),
        exhibit_loader(input.unloaded, {exhibit, relighter, store, metrics}),
        encode(input.server.jpeg_quality, demand, metrics),
        room_keeper(std::move(the_keep), builder, metrics) {
    if (input.tag_map) builder.restore_tag_map(*std::move(input.tag_map));
    builder.restore_views(std::move(input.views));
    if (input.room) builder.restore_room(*std::move(input.room));
  }

  template <typename T>
  void put(Mailbox<T>& box, T item) {
    if (box.put(std::move(item))) metrics.drop(box.reader());
  }

  /// Repeats `turn` on a thread of its own until stop is requested. Exceptions become warnings of the frames.
  void run(const std::string& stage, bool behind, std::function<void()> turn) {
    threads.emplace_back([this, stage, behind, turn = std::move(turn)] {
      pthread_setname_np(pthread_self(), stage.c_str());  // for `top -H`
      if (behind) background_threads.add();
      while (!stopping.stop_requested()) {
        if (!behind) heartbeats.beat(stage);
        try {
          turn();
        } catch (const std::exception& e) {
          store.publish_warnings(stage + " stage", {stage + ": " + e.what()});
          sleep_until(Clock::now() + kPipeline.tick);
        }
      }
      heartbeats.forget(stage);
    });
  }

  bool unwatched() { return audience.stages_may_rest(builder.learning(), Clock::now()); }
  /// Of a background stage, as a multiple of its processor time.
  int rest(int later) {
    const bool learning = builder.learning();
    if (audience.background_may_rest(learning, Clock::now())) return kPipeline.unwatched_rest;
    return learning ? kPipeline.rest : later;
  }
  /// False if stop was requested meanwhile.
  bool wait_for_pose() {
    // On few cores the next pose would delay the picture that somebody waits for.
    const std::stop_token stop = stopping.get_token();
    return audience.waits_for_picture(Clock::now())
               ? just_in_time.wait_for_relight(kPipeline.first_picture_patience, stop)
               : just_in_time.wait_for_pose(stop);
  }
  /// False if stop was requested meanwhile.
  bool sleep_until(Clock::time_point moment) const { return server::sleep_until(moment, stopping.get_token()); }

  void publish_faults(std::vector<std::string> found);
  void capture_turn();
  void fisheye_turn();
  PosedFrame pose_of(const PlayedFrame& played);
  void pose_turn(std::uint64_t& round);
  void relight_turn();
  void geometry_turn();
  void lamp_tags_turn();
  void light_turn();
  void albedo_turn();
  void room_turn();
  void models_turn();
  void maps_turn();
  void keep_turn();
  void encode_turn();
};

/// Called for every frame, and in every timeout while none arrives.
void Pipeline::State::publish_faults(std::vector<std::string> found) {
  store.publish_warnings("camera", found);
  metrics.cameras_with_faults(static_cast<int>(found.size()));
  std::lock_guard lock(newest_mutex);
  faults = std::move(found);
}

void Pipeline::State::capture_turn() {
  const std::optional<PlayedFrame> played = frames.next(stopping.get_token(), playback.take());
  std::vector<std::string> found = frames.faults();
  if (fisheye && !fisheye->fault().empty()) reconstruct::append_warnings(found, {fisheye->fault()});
  publish_faults(std::move(found));
  if (!played) {
    if (frames.gone() && !stopping.stop_requested()) {
      store.publish_warnings("camera", {"the recording delivers no frames and is opened again every second"});
      sleep_until(Clock::now() + 10 * kPipeline.tick);
      frames = FramePlayer(open_again().frames);
    }
    return;
  }
  if (!frames.live()) playback.shown(frames.at_s(), frames.length_s());
  {
    std::lock_guard lock(newest_color_mutex);
    newest_color = played->frame->color;
  }
  if (!played->frame->fisheye.empty()) to_light.put({played->frame->fisheye, played->frame->color});
  if (to_pose.put(*played) && !unwatched()) metrics.drop(pose_waits_for_relight ? "relight" : "pose");
}

/// Light is limited to light_every by design: fish-eye frames that it skips are not counted as dropped.
void Pipeline::State::fisheye_turn() {
  std::optional<capture::FisheyeReader::Result> seen = fisheye->next(kPipeline.tick);
  if (!seen) return;
  store.publish_warnings("fish-eye", std::move(seen->warnings));
  if (seen->frames.empty()) return;
  FisheyeView view{std::move(seen->frames), nullptr};
  {
    std::lock_guard lock(newest_color_mutex);
    view.color = newest_color;
  }
  if (view.color && std::abs(view.color->stamp.time_ns - view.frames.front()->stamp.time_ns) > kPipeline.moment_ns) {
    view.color = nullptr;
  }
  to_light.put(std::move(view));
}

PosedFrame Pipeline::State::pose_of(const PlayedFrame& played) {
  PosedFrame posed{played, posed_at, {}, {}};
  {
    const StageTimer timer(metrics, "register depth");
    posed.played.frame = std::make_shared<capture::FrameSet>(builder.register_depth(*played.frame));
  }
  try {
    const StageTimer timer(metrics, "pose");
    posed.located = builder.locate_camera(*posed.played.frame);
  } catch (const std::exception& e) {
    posed.located.warnings.push_back(std::string("pose: ") + e.what());
  }
  posed.completed = builder.complete_depth(*posed.played.frame, posed.located.pose);
  try {
    const StageTimer timer(metrics, "color gain");
    const reconstruct::ColorGainStage::Result color = builder.estimate_color_gain(posed.completed, posed.located.pose);
    posed.completed.color_gain = {color.gain[0], color.gain[1], color.gain[2]};
    posed.completed.color_vignetting = color.vignetting;
    posed.completed.color_shows_room = color.shows_room;
    reconstruct::append_warnings(posed.located.warnings, color.warnings);
  } catch (const std::exception& e) {
    posed.located.warnings.push_back(std::string("color gain: ") + e.what());
  }
  return posed;
}

void Pipeline::State::pose_turn(std::uint64_t& round) {
  pose_waits_for_relight = true;
  if (!to_relight.wait_until_taken(kPipeline.tick) || !wait_for_pose()) return;
  pose_waits_for_relight = false;
  const bool rests = unwatched();
  if (rests && Clock::now() < posed_at + kPipeline.unwatched_period) {
    sleep_until(Clock::now() + kPipeline.looks_for_audience);
    return;
  }
  const std::optional<PlayedFrame> played = to_pose.take(kPipeline.tick);
  if (!played) return;
  if (played->round != round) {
    round = played->round;
    builder.restart_tracking();
  }
  posed_at = Clock::now();
  const auto posed = std::make_shared<const PosedFrame>(pose_of(*played));
  just_in_time.pose_took(Clock::now() - posed_at);
  metrics.frame_posed(rests);
  const std::optional<reconstruct::Pose>& where = posed->located.pose;
  if (where && posed->completed.depth && geometry_rest.over(rest(kPipeline.geometry_rest_later))) {
    put(to_geometry, posed);
  }
  if (!session.lamps.empty() && lamp_tags_rest.over(rest(kPipeline.rest))) put(to_lamp_tags, posed);
  if (rests && posed_at < shown_at + kPipeline.unwatched_picture_period) return;
  shown_at = posed_at;
  put(to_relight, posed);
}

void Pipeline::State::relight_turn() {
  const std::shared_ptr<const PosedFrame> posed = to_relight.take(kPipeline.tick).value_or(nullptr);
  if (!posed) return;
  just_in_time.relight_begins();
  const capture::FrameSet& frame = posed->completed;
  const reconstruct::PoseStage::Result& located = posed->located;
  std::vector<std::string> warnings = frame.warnings;
  reconstruct::append_warnings(warnings, located.warnings);
  reconstruct::Scene scene = store.newest();
  scene.pose = located.pose;
  const bool settled = store.settled(scene);
  reconstruct::append_warnings(warnings, scene.warnings);
  LiveRelighter::Result relit;
  bool any_visible = false;
  {
    const StageTimer timer(metrics, "relight");
    const double time_s = 1e-9 * static_cast<double>(frame.time_ns);
    const relight::Exhibit shown = shown_exhibit(*exhibit.at(time_s), scene, time_s, standing);
    any_visible = std::ranges::any_of(shown.objects, &relight::VirtualObject::visible);
    const relight::Planner::Decision decision = planner.decide(scene, shown, time_s);
    for (const relight::PlanChoice& choice : decision.choices)
      metrics.decided(choice.key, choice.value, choice.left_out);
    relit = relighter.relight(frame, scene, shown, decision.plan);
  }
  for (const relight::gpu::PassTime& pass : relit.picture.passes) {
    metrics.time("relight/" + pass.name, 1e-3 * pass.gpu_ms);
  }
  reconstruct::append_warnings(warnings, relit.picture.warnings);
  metrics.frame_made(!relit.picture.passed_through || !any_visible);
  metrics.warn(warnings.size());

  ShownFrame shown;
  shown.srgb = std::make_shared<const capture::Image<std::uint8_t>>(std::move(relit.picture.srgb));
  shown.passed_through = relit.picture.passed_through;
  shown.captured = posed->played.captured;
  {
    std::lock_guard lock(newest_mutex);
    shown.sequence = newest.sequence + 1;
    newest = shown;
    newest_scene = scene;
    newest_camera = frame.color;
    newest_record = {
        .warnings = std::move(warnings),
        .T_tag_camera = located.pose ? std::optional(located.pose->T_tag_exhibit.inverse() * located.pose->T_tag_camera)
                                     : std::nullopt,
        .plan = relit.picture.plan,
        .learning = builder.learning(),
        .settled = settled && relit.up_to_date,
        .field_version = scene.field ? scene.field->version : 0,
        .light_version = scene.illumination ? scene.illumination->version : 0,
        .albedo_version = scene.albedo ? scene.albedo->version : 0};
  }
  audience.picture_made(posed->begun);
  put(to_encode, std::move(shown));
  just_in_time.relight_ends();
}

void Pipeline::State::geometry_turn() {
  if (const std::shared_ptr<const PosedFrame> posed = to_geometry.take(kPipeline.tick).value_or(nullptr)) {
    const ScopedWork work(geometry_rest);
    const StageTimer timer(metrics, "fuse");
    builder.fuse_depth(posed->completed, *posed->located.pose);
    const auto memory = builder.fusion_memory();
    metrics.fused(memory.bricks, memory.used_bytes, memory.evicted);
    store.publish_warnings("geometry stage", {});
  }
}

void Pipeline::State::lamp_tags_turn() {
  if (const std::shared_ptr<const PosedFrame> posed = to_lamp_tags.take(kPipeline.tick).value_or(nullptr)) {
    const ScopedWork work(lamp_tags_rest);
    const StageTimer timer(metrics, "lamp tags");
    builder.locate_lamp_tags(*posed->played.frame, posed->located.pose);
    store.publish_warnings("lamp tags stage", {});
  }
}

/// Extracts light from the newest fish-eye frame; if there is none, only moves lamps to their newest tag poses.
void Pipeline::State::light_turn() {
  const Clock::time_point rested = light_rest.ends(rest(kPipeline.rest));
  if (Clock::now() < rested) {
    sleep_until(std::min<Clock::time_point>(rested, Clock::now() + kPipeline.tick));  // somebody may come meanwhile
    return;
  }
  if (const std::optional<FisheyeView> view = to_light.take(kPipeline.tick)) {
    const ScopedWork work(light_rest);
    const StageTimer timer(metrics, "light");
    builder.extract_light(view->frames, view->color.get());
  } else {
    builder.extract_light({}, nullptr);
  }
  store.publish_warnings("light stage", {});
}

void Pipeline::State::albedo_turn() {
  if (!builder.solve_albedo()) {
    sleep_until(Clock::now() + kPipeline.tick / 2);
    return;
  }
  metrics.decided("albedo_patience", builder.albedo_patience());
  store.publish_warnings("albedo stage", {});
}

void Pipeline::State::room_turn() {
  const reconstruct::Scene scene = store.newest();
  if (!relighter.wants_prepared(scene) || !room_rest.over(rest(kPipeline.room_rest_later))) {
    sleep_until(Clock::now() + kPipeline.tick / 2);
    return;
  }
  const ScopedWork work(room_rest);
  const StageTimer timer(metrics, "room");
  relighter.prepare(scene);
  store.publish_warnings("room stage", {});
}

void Pipeline::State::models_turn() {
  if (!exhibit_loader.step()) sleep_until(Clock::now() + kPipeline.tick / 2);
}

void Pipeline::State::maps_turn() {
  const std::optional<MapKind> kind = maps.due(Clock::now());
  if (!kind) {
    sleep_until(Clock::now() + kPipeline.tick / 4);
    return;
  }
  MapDrawer::Newest source;
  {
    std::lock_guard lock(newest_mutex);
    source = {newest_camera, newest.srgb, newest_scene, newest.sequence};
  }
  maps.draw(*kind, std::move(source));
  store.publish_warnings("maps stage", {});
}

void Pipeline::State::keep_turn() {
  if (!sleep_until(room_keeper.due())) return;
  room_keeper.keep_due();
  store.publish_warnings("keep room stage", {});
}

void Pipeline::State::encode_turn() {
  std::optional<ShownFrame> picture =
      to_encode.take(encoded_for_viewers ? kPipeline.tick : kPipeline.looks_for_audience);
  const bool viewers_came = !std::exchange(encoded_for_viewers, demand.any()) && encoded_for_viewers;
  if (picture) {
    last_encoded = Clock::now();
  } else if (viewers_came) {
    // Whoever comes first sees the picture before, up to half a minute old, until one is made.
    std::lock_guard lock(newest_mutex);
    if (newest.srgb) picture = newest;
  } else if (Clock::now() - last_encoded > kPipeline.keep_alive) {
    // While the camera is disconnected its last image is sent again, also for viewers that connect now.
    std::lock_guard lock(newest_mutex);
    if (!faults.empty() && newest.srgb) {
      picture = newest;
      picture->captured = last_encoded = Clock::now();
    }
  }
  if (picture) {
    for (auto& message : encode.encode(*picture)) publish(std::move(message));
    if (!viewers_came) {
      metrics.time("capture_to_send", std::chrono::duration<double>(Clock::now() - picture->captured).count());
    }
    store.publish_warnings("encode stage", {});
  }
}

Pipeline::Pipeline(ServiceInput input, Cameras cameras, OpenCameras open_again, LiveRelighter::MakeDevice make_device,
                   EncoderDemand& demand, Metrics& metrics, Publish publish, Keep keep)
    : state_(std::make_unique<State>(std::move(input), std::move(cameras), std::move(open_again),
                                     std::move(make_device), demand, metrics, std::move(publish), std::move(keep))) {}

Pipeline::~Pipeline() {
  stop();
  join();
}

void Pipeline::start() {
  State& s = *state_;
  s.run("encode", false, [&s] { s.encode_turn(); });
  s.run("relight", false, [&s] { s.relight_turn(); });
  s.run("pose", false, [&s, round = std::uint64_t{0}]() mutable { s.pose_turn(round); });
  s.run("light", true, [&s] { s.light_turn(); });
  if (!s.session.lamps.empty()) s.run("lamp tags", true, [&s] { s.lamp_tags_turn(); });
  s.run("geometry", true, [&s] { s.geometry_turn(); });
  s.run("albedo", true, [&s] { s.albedo_turn(); });
  if (s.relighter.draws_prepared()) s.run("room", true, [&s] { s.room_turn(); });
  s.run("models", true, [&s] { s.models_turn(); });
  s.run("maps", true, [&s] { s.maps_turn(); });
  if (s.room_keeper.keeps()) s.run("keep room", true, [&s] { s.keep_turn(); });
  s.run("capture", false, [&s] { s.capture_turn(); });
  if (s.fisheye) s.run("fisheye", false, [&s] { s.fisheye_turn(); });
}

void Pipeline::stop() {
  State& s = *state_;
  s.stopping.request_stop();
  s.background_threads.restore_priority();
  s.to_pose.close();
  s.to_relight.close();
  s.to_geometry.close();
  s.to_lamp_tags.close();
  s.to_light.close();
  s.to_encode.close();
}

void Pipeline::join() { state_->threads.clear(); }

ExhibitState& Pipeline::exhibit() { return state_->exhibit; }

std::optional<std::string> Pipeline::change_object(ObjectCommand command) {
  State& s = *state_;
  const std::optional<relight::VirtualObject> object = s.exhibit.object(command);
  if (command.on_pixel && object) {
    reconstruct::Scene scene;
    {
      std::lock_guard lock(s.newest_mutex);
      scene = s.newest_scene;
    }
    if (!scene.pose || !scene.field)
      return "on_pixel: found no pose of the camera or no surface yet, allowed: while objects are shown";
    const auto place = place_on_picked_surface({scene.pose->T_tag_camera, scene.pose->T_tag_exhibit, scene.field.get()},
                                               s.session.color.model, *command.on_pixel, *object);
    if (const auto* error = std::get_if<std::string>(&place)) return *error;
    command.position_m = std::get<Eigen::Vector3d>(place);
  }
  return s.exhibit.apply(command);
}

void Pipeline::replace_exhibit(relight::Exhibit exhibit, ExhibitLimits limits) {
  state_->exhibit_loader.replace(std::move(exhibit), std::move(limits));
}

Playback& Pipeline::playback() { return state_->playback; }

std::optional<reconstruct::KeyframeMap::Views> Pipeline::take_views() { return state_->builder.take_views(); }

void Pipeline::keep_room() { state_->room_keeper.keep(); }

std::optional<std::string> Pipeline::hung(std::chrono::steady_clock::duration limit) const {
  if (state_->relighter.gave_up()) return "GPU";
  return state_->heartbeats.hung(limit);
}

std::optional<reconstruct::TagMap::State> Pipeline::take_tag_map() { return state_->builder.take_tag_map(); }

std::optional<MapPicture> Pipeline::map(MapKind kind) {
  picture_asked();
  return state_->maps.ask(kind, Clock::now());
}

void Pipeline::picture_asked() { state_->audience.seen(Clock::now()); }

ShownFrame Pipeline::newest() const {
  std::lock_guard lock(state_->newest_mutex);
  return state_->newest;
}

Pipeline::Record Pipeline::newest_record() const {
  std::lock_guard lock(state_->newest_mutex);
  Record record = state_->newest_record;
  // Camera faults first: other warnings often follow from them.
  std::vector<std::string> warnings = state_->faults;
  reconstruct::append_warnings(warnings, record.warnings);
  record.warnings = std::move(warnings);
  return record;
}

}  // namespace lumigraft::server
