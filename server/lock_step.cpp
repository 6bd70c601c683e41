#include "server/lock_step.h"

#include <chrono>
#include <ctime>
#include <utility>

#include "reconstruct/light.h"
#include "reconstruct/pose.h"
#include "server/camera_picture.h"
#include "server/scene_board.h"

namespace lumigraft {
namespace {

double process_cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

/// Runs one stage of a frame: its cost is noted, what it throws becomes a warning.
template <typename Function>
void run_stage(FrameRecord& record, const std::string& name, Function function) {
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = process_cpu_ms();
  try {
    function();
  } catch (const gpu::GpuError&) {
    throw;
  } catch (const std::exception& e) {
    append_warnings(record.warnings, {name + ": " + e.what()});
  }
  StageCost& cost = record.stages[name];
  cost.wall_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  cost.cpu_ms = process_cpu_ms() - cpu_start;
}

}  // namespace

struct LockStep::State {
  Exhibit exhibit;
  Plan plan;
  std::unique_ptr<Oracle> oracle;
  PoseStage pose;
  FusionStage fusion;
  LightStage light;
  AlbedoStage albedo;
  Relighter relighter;
  AlbedoSchedule schedule;
  SceneBoard board;

  State(const Session& session, Exhibit the_exhibit, const Plan& the_plan, std::shared_ptr<gpu::Device> device,
        std::unique_ptr<Oracle> the_oracle)
      : exhibit(std::move(the_exhibit)),
        plan(the_plan),
        oracle(std::move(the_oracle)),
        pose(session.tag, session.color.model, session.color.response),
        fusion(session, FusionSettings{}),
        light(session, LightSettings{}),
        albedo(session),
        relighter(std::move(device), session) {}

  OracleParts parts() const { return oracle ? oracle->parts() : OracleParts{}; }

  void solve_albedo(FrameRecord& record, const FrameSet& frame, const std::optional<Pose>& where) {
    const std::shared_ptr<const DistanceField> field = board.newest().field;
    const std::shared_ptr<const Illumination> measured = board.measured_light();
    if (field && measured && schedule.due(*field, *measured)) {
      schedule.solved(*field, *measured);
      run_stage(record, "albedo", [&] {
        AlbedoStage::Result solution = albedo.solve(*field, *measured);
        if (parts().light) {
          solution.illumination = measured;
        }
        board.publish_solution(std::move(solution), field->version, measured->version);
      });
    }
    if (parts().albedo && where && field) {
      run_stage(record, "true albedo", [&] { board.publish_albedo(oracle->albedo(frame, *where, *field)); });
    }
  }
};

LockStep::LockStep(const Session& session, Exhibit exhibit, const Plan& plan, std::shared_ptr<gpu::Device> device,
                   std::unique_ptr<Oracle> oracle)
    : state_(std::make_unique<State>(session, std::move(exhibit), plan, std::move(device), std::move(oracle))) {}

LockStep::~LockStep() = default;

FrameRecord LockStep::step(const FrameSet& sensed, bool with_maps) {
  State& s = *state_;
  const OracleParts truth = s.parts();
  FrameRecord record;
  std::optional<Pose> pose;
  append_warnings(record.warnings, sensed.warnings);
  const FrameSet frame = truth.geometry ? s.oracle->with_true_depth(sensed) : sensed;

  run_stage(record, "pose", [&] {
    if (truth.pose) {
      pose = s.oracle->pose(frame);
      return;
    }
    PoseStage::Result result = s.pose.locate(frame);
    pose = result.pose;
    append_warnings(record.warnings, result.warnings);
  });
  run_stage(record, "light", [&] {
    if (truth.light) {
      s.board.publish_light(s.oracle->illumination(frame));
      return;
    }
    LightStage::Result result = s.light.extract(frame);
    s.board.publish_light(result.illumination);
    s.board.publish_warnings("light", result.warnings);
  });
  // Depth seen from a pose of the past would smear the field.
  if (pose && pose->age_ns == 0 && frame.depth) {
    run_stage(record, "fuse", [&] { s.board.publish_field(s.fusion.fuse(frame, *pose)); });
  }
  s.solve_albedo(record, frame, pose);

  record.scene = s.board.newest();
  record.scene.pose = pose;
  append_warnings(record.warnings, record.scene.warnings);
  run_stage(record, "relight",
            [&] { record.picture = s.relighter.relight(frame, record.scene, s.exhibit, s.plan, with_maps); });
  append_warnings(record.warnings, record.picture.warnings);
  if (record.picture.srgb.empty()) {
    record.picture.srgb = camera_picture(*frame.color);
  }
  return record;
}

}  // namespace lumigraft
