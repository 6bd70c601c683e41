#include "server/pipeline/pipeline.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "reconstruct/fusion/fusion.h"
#include "reconstruct/light/light.h"
#include "reconstruct/pose/lamp_tags.h"
#include "reconstruct/pose/pose.h"
#include "reconstruct/room/mirror_detection.h"
#include "relight/planner.h"
#include "server/pipeline/albedo_schedule.h"
#include "server/pipeline/frame_player.h"
#include "server/pipeline/mailbox.h"
#include "server/pipeline/pacing.h"
#include "server/pipeline/scene_board.h"

namespace lumigraft::server {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kTick{100};
constexpr std::chrono::milliseconds kGeometryEvery{100}, kLightEvery{100}, kAlbedoEvery{1000}, kRoomEvery{1000};
constexpr std::chrono::milliseconds kKeepAlive{1000};
constexpr int kBehindThePicture = 10;  // niceness of geometry, light and albedo
// How long these rest, in times of their work: a third of a core each while the room is unknown; after that a tenth for
// geometry and for what rays meet of it, and a twentieth for albedo, whose newest answers hardly differ from the ones
// before.
constexpr int kRest = 2, kGeometryRestLater = 9, kAlbedoRestLater = 19, kRoomRestLater = 9;

struct PosedFrame {
  PlayedFrame played;
  reconstruct::PoseStage::Result located;
};

struct AlbedoTurn {
  AlbedoSchedule schedule;
  bool due = true;   ///< everything is to be solved
  bool must = true;  ///< and what is new cannot be solved alone
};

/// Threads that work behind the picture, with lower priority.
class BackgroundThreads {
 public:
  /// The calling thread joins them.
  void add() {
    const auto thread = static_cast<id_t>(syscall(SYS_gettid));
    std::lock_guard lock(mutex_);
    threads_.push_back(thread);
    setpriority(PRIO_PROCESS, thread, kBehindThePicture);
  }
  /// Lifts them again where the system lets it. A process is gone only when its last thread is, and that one frees its
  /// memory: on a busy machine a thread behind takes seconds for it.
  void restore_priority() {
    std::lock_guard lock(mutex_);
    for (const id_t thread : threads_) {
      setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, static_cast<id_t>(getpid())));
    }
    threads_.clear();
  }

 private:
  std::mutex mutex_;
  std::vector<id_t> threads_;
};

}  // namespace

struct Pipeline::State {
  const capture::Session session;
  ExhibitState exhibit;
  OpenFrames open_again;
  FramePlayer frames;
  Playback playback;
  EncoderDemand& demand;
  Metrics& metrics;
  Publish publish;

  reconstruct::PoseStage pose;
  reconstruct::FusionStage fusion;
  reconstruct::LampTagStage marks;
  reconstruct::LightStage light;
  reconstruct::AlbedoStage albedo;
  reconstruct::EnclosureStage enclosure;
  relight::Planner planner;
  LiveRelighter relighter;
  EncodeStage encode;

  SceneStore board;
  std::atomic<bool> learning = true;
  Mailbox<PlayedFrame> to_pose{"pose"};
  Mailbox<std::shared_ptr<const PosedFrame>> to_relight{"relight"};
  std::atomic<bool> pose_waits_for_relight = false;
  LatencyScheduler just_in_time;
  Mailbox<std::shared_ptr<const PosedFrame>> to_geometry{"fuse"};
  Mailbox<std::shared_ptr<const PosedFrame>> to_light{"light"};
  Mailbox<ShownPicture> to_encode{"encode"};
  DutyCycle geometry_rest{kGeometryEvery}, light_rest{kLightEvery}, albedo_rest{kAlbedoEvery},
      all_albedo_rest{kAlbedoEvery}, room_rest{kRoomEvery};

  mutable std::mutex newest_mutex;
  ShownPicture newest;
  Record newest_record;
  std::vector<std::string> troubles;  ///< of cameras, now

  Clock::time_point last_encoded{};  ///< of the encode thread

  std::stop_source stopping;
  BackgroundThreads threads_behind;
  std::vector<std::jthread> threads;

  State(ServiceInput input, std::unique_ptr<capture::FrameReader> reader, OpenFrames the_open_again,
        LiveRelighter::MakeDevice make_device, EncoderDemand& the_demand, Metrics& the_metrics, Publish the_publish)
      : session(input.session),
        exhibit(std::move(input.exhibit)),
        open_again(std::move(the_open_again)),
        frames(std::move(reader)),
        demand(the_demand),
        metrics(the_metrics),
        publish(std::move(the_publish)),
        pose(session.tag, session.color.model, session.color.response),
        fusion(session, reconstruct::FusionSettings{}),
        marks(session),
        light(session, reconstruct::LightSettings{}),
        albedo(session),
        planner(input.plan),
        relighter(session, input.plan, std::move(make_device)),
        encode(input.server.jpeg_quality, demand, metrics) {}

  template <typename T>
  void put(Mailbox<T>& box, T item) {
    if (box.put(std::move(item))) {
      metrics.drop(box.reader());
    }
  }

  /// Repeats `turn` on a thread of its own until told to stop. What it throws becomes a warning of the frames.
  void run(const std::string& stage, bool behind, std::function<void()> turn) {
    threads.emplace_back([this, stage, behind, turn = std::move(turn)] {
      pthread_setname_np(pthread_self(), stage.c_str());  // for `top -H`
      if (behind) {
        threads_behind.add();
      }
      while (!stopping.stop_requested()) {
        try {
          turn();
        } catch (const std::exception& e) {
          board.publish_warnings(stage + " stage", {stage + ": " + e.what()});
          sleep_until(Clock::now() + kTick);
        }
      }
    });
  }

  /// False when told to stop meanwhile.
  bool sleep_until(Clock::time_point moment) const {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any().wait_until(lock, stopping.get_token(), moment, [] { return false; });
    return !stopping.stop_requested();
  }

  void note_troubles(std::vector<std::string> found);
  void capture_turn();
  void pose_turn(std::uint64_t& round);
  void relight_turn();
  void geometry_turn();
  void light_turn();
  void albedo_turn(AlbedoTurn& turn);
  void room_turn();
  void encode_turn();
};

/// With every frame, and beside the last one while none comes.
void Pipeline::State::note_troubles(std::vector<std::string> found) {
  board.publish_warnings("camera", found);
  metrics.cameras_in_trouble(static_cast<int>(found.size()));
  std::lock_guard lock(newest_mutex);
  troubles = std::move(found);
}

void Pipeline::State::capture_turn() {
  const std::optional<PlayedFrame> played = frames.next(stopping.get_token(), playback.take());
  note_troubles(frames.troubles());
  if (!played) {
    if (frames.gone() && !stopping.stop_requested()) {
      board.publish_warnings("camera", {"the recording gives no pictures and is opened again every second"});
      sleep_until(Clock::now() + 10 * kTick);
      frames = FramePlayer(open_again());
    }
    return;
  }
  if (!frames.live()) {
    playback.shown(frames.at_s(), frames.length_s());
  }
  if (to_pose.put(*played)) {
    metrics.drop(pose_waits_for_relight ? "relight" : "pose");
  }
}

void Pipeline::State::pose_turn(std::uint64_t& round) {
  pose_waits_for_relight = true;
  if (!to_relight.wait_until_taken(kTick) || !sleep_until(just_in_time.pose_begins())) {
    return;
  }
  pose_waits_for_relight = false;
  const std::optional<PlayedFrame> played = to_pose.take(kTick);
  if (!played) {
    return;
  }
  if (played->round != round) {
    round = played->round;
    pose.reset();  // time went back; the room is the same, so field, light and albedo stay
  }
  const auto posed = std::make_shared<PosedFrame>(PosedFrame{*played, {}});
  {
    const StageTimer timer(metrics, "pose");
    const Clock::time_point begin = Clock::now();
    try {
      posed->located = pose.locate(*played->frame, board.newest().field.get());
    } catch (const std::exception& e) {
      posed->located.warnings.push_back(std::string("pose: ") + e.what());
    }
    just_in_time.pose_took(Clock::now() - begin);
  }
  const std::optional<reconstruct::Pose>& where = posed->located.pose;
  if (where && where->age_ns == 0 && played->frame->depth &&
      geometry_rest.over(learning ? kRest : kGeometryRestLater)) {
    put(to_geometry, std::shared_ptr<const PosedFrame>(posed));
  }
  if (light_rest.over(kRest)) {
    put(to_light, std::shared_ptr<const PosedFrame>(posed));
  }
  put(to_relight, std::shared_ptr<const PosedFrame>(posed));
}

void Pipeline::State::relight_turn() {
  const std::shared_ptr<const PosedFrame> posed = to_relight.take(kTick).value_or(nullptr);
  if (!posed) {
    return;
  }
  just_in_time.relight_begins();
  const Clock::time_point begin = Clock::now();
  const capture::FrameSet& frame = *posed->played.frame;
  const reconstruct::PoseStage::Result& located = posed->located;
  std::vector<std::string> warnings = frame.warnings;
  append_warnings(warnings, located.warnings);
  reconstruct::Scene scene = board.newest();
  scene.pose = located.pose;
  const bool settled = board.settled(scene);
  append_warnings(warnings, scene.warnings);
  LiveRelighter::Result relit;
  {
    const StageTimer timer(metrics, "relight");
    const std::shared_ptr<const relight::Exhibit> shown_exhibit = exhibit.newest();
    const relight::Planner::Decision decision =
        planner.decide(scene, *shown_exhibit, 1e-9 * static_cast<double>(frame.time_ns));
    for (const relight::PlanChoice& choice : decision.choices)
      metrics.decided(choice.key, choice.value, choice.left_out);
    relit = relighter.relight(frame, scene, *shown_exhibit, decision.plan);
  }
  for (const relight::gpu::PassTime& pass : relit.picture.passes) {
    metrics.time("relight/" + pass.name, 1e-3 * pass.gpu_ms);
  }
  append_warnings(warnings, relit.picture.warnings);
  metrics.frame_made();
  metrics.warn(warnings.size());

  ShownPicture shown;
  shown.srgb = std::make_shared<const capture::Image<std::uint8_t>>(std::move(relit.picture.srgb));
  shown.passed_through = relit.passed_through;
  shown.captured = posed->played.captured;
  {
    std::lock_guard lock(newest_mutex);
    shown.sequence = newest.sequence + 1;
    newest = shown;
    newest_record.warnings = std::move(warnings);
    newest_record.plan = relit.picture.plan;
    newest_record.learning = learning;
    newest_record.settled = settled && relit.up_to_date;
    newest_record.field_version = scene.field ? scene.field->version : 0;
    newest_record.light_version = scene.illumination ? scene.illumination->version : 0;
    newest_record.albedo_version = scene.albedo ? scene.albedo->version : 0;
    newest_record.T_tag_camera.reset();
    if (located.pose) {
      newest_record.T_tag_camera = located.pose->T_tag_camera;
    }
  }
  put(to_encode, std::move(shown));
  just_in_time.relight_took(Clock::now() - begin);
}

void Pipeline::State::geometry_turn() {
  if (const std::shared_ptr<const PosedFrame> posed = to_geometry.take(kTick).value_or(nullptr)) {
    const ScopedWork work(geometry_rest);
    const StageTimer timer(metrics, "fuse");
    board.publish_field(fusion.fuse(*posed->played.frame, *posed->located.pose));
    board.publish_warnings("geometry", fusion.warnings());
    board.publish_warnings("geometry stage", {});
  }
}

void Pipeline::State::light_turn() {
  if (const std::shared_ptr<const PosedFrame> posed = to_light.take(kTick).value_or(nullptr)) {
    const ScopedWork work(light_rest);
    const StageTimer timer(metrics, "light");
    reconstruct::LampTagStage::Result marked = marks.locate(*posed->played.frame, posed->located.pose);
    reconstruct::LightStage::Result result = light.extract(*posed->played.frame, marked.marks);
    append_warnings(result.warnings, marked.warnings);
    board.publish_light(result.illumination);
    board.publish_warnings("light", std::move(result.warnings));
    board.publish_warnings("light stage", {});
  }
}

void Pipeline::State::albedo_turn(AlbedoTurn& turn) {
  AlbedoSchedule& schedule = turn.schedule;
  const std::shared_ptr<const reconstruct::DistanceField> field = board.newest().field;
  const std::shared_ptr<const reconstruct::Illumination> measured = board.measured_light();
  if (field && measured) {
    learning = schedule.changed_much(*field, *measured);
  }
  const int times = learning ? kRest : kAlbedoRestLater;
  const bool all = turn.due && (turn.must || all_albedo_rest.over(times));
  DutyCycle& rest = all ? all_albedo_rest : albedo_rest;
  if (!field || !measured || !rest.over(times) || !(all || schedule.changed(*field, *measured))) {
    sleep_until(Clock::now() + kTick / 2);
    return;
  }
  if (!learning && !rest.over(kAlbedoRestLater * schedule.patience()) && !schedule.moved(*field, *measured)) {
    sleep_until(Clock::now() + 10 * kTick);  // looking for what moved takes some milliseconds
    return;
  }
  reconstruct::AlbedoStage::Result solution;
  if (all) {
    const ScopedWork work(rest);
    const StageTimer timer(metrics, "albedo");
    turn.due = turn.must = false;
    schedule.begin(field, *measured);
    solution = albedo.solve_all(*field, *measured);
    if (solution.illumination) {
      board.publish_enclosure(enclosure.close(*field, *solution.illumination));
      board.publish_warnings("mirrors", reconstruct::mirror_warnings(reconstruct::room_points(*field), *field));
    }
  } else {
    const ScopedWork work(rest);
    const StageTimer timer(metrics, "albedo/new");
    std::optional<reconstruct::AlbedoStage::Result> found = albedo.solve_new(*field, *measured);
    turn.must = !found;
    turn.due = turn.must || found->due;
    if (turn.must) return;
    schedule.begin(field, *measured);
    solution = *std::move(found);
  }
  schedule.solved(solution.albedo);
  metrics.decided("albedo_patience", schedule.patience());
  board.publish_solution(std::move(solution), field->version, measured);
  board.publish_warnings("albedo stage", {});
}

void Pipeline::State::room_turn() {
  const reconstruct::Scene scene = board.newest();
  if (!relighter.wants_prepared(scene) || !room_rest.over(learning ? kRest : kRoomRestLater)) {
    sleep_until(Clock::now() + kTick / 2);
    return;
  }
  const ScopedWork work(room_rest);
  const StageTimer timer(metrics, "room");
  relighter.prepare(scene);
  board.publish_warnings("room stage", {});
}

void Pipeline::State::encode_turn() {
  std::optional<ShownPicture> picture = to_encode.take(kTick);
  if (picture) {
    last_encoded = Clock::now();
  } else if (Clock::now() - last_encoded > kKeepAlive) {
    // While the camera is away its last picture stays, for those who come now too.
    std::lock_guard lock(newest_mutex);
    if (!troubles.empty() && newest.srgb) {
      picture = newest;
      picture->captured = last_encoded = Clock::now();
    }
  }
  if (picture) {
    for (auto& message : encode.encode(*picture)) {
      publish(std::move(message));
    }
    metrics.time("capture_to_send", std::chrono::duration<double>(Clock::now() - picture->captured).count());
    board.publish_warnings("encode stage", {});
  }
}

Pipeline::Pipeline(ServiceInput input, std::unique_ptr<capture::FrameReader> frames, OpenFrames open_again,
                   LiveRelighter::MakeDevice make_device, EncoderDemand& demand, Metrics& metrics, Publish publish)
    : state_(std::make_unique<State>(std::move(input), std::move(frames), std::move(open_again), std::move(make_device),
                                     demand, metrics, std::move(publish))) {}

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
  s.run("geometry", true, [&s] { s.geometry_turn(); });
  s.run("albedo", true, [&s, turn = AlbedoTurn()]() mutable { s.albedo_turn(turn); });
  if (s.relighter.draws_prepared()) s.run("room", true, [&s] { s.room_turn(); });
  s.run("capture", false, [&s] { s.capture_turn(); });
}

void Pipeline::stop() {
  State& s = *state_;
  s.stopping.request_stop();
  s.threads_behind.restore_priority();
  s.to_pose.close();
  s.to_relight.close();
  s.to_geometry.close();
  s.to_light.close();
  s.to_encode.close();
}

void Pipeline::join() { state_->threads.clear(); }

ExhibitState& Pipeline::exhibit() { return state_->exhibit; }

Playback& Pipeline::playback() { return state_->playback; }

ShownPicture Pipeline::newest() const {
  std::lock_guard lock(state_->newest_mutex);
  return state_->newest;
}

Pipeline::Record Pipeline::newest_record() const {
  std::lock_guard lock(state_->newest_mutex);
  Record record = state_->newest_record;
  // A camera that is away says most: the rest follows from it.
  std::vector<std::string> warnings = state_->troubles;
  append_warnings(warnings, record.warnings);
  record.warnings = std::move(warnings);
  return record;
}

}  // namespace lumigraft::server
