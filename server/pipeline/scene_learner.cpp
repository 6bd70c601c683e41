#include "server/pipeline/scene_learner.h"

#include <utility>

#include "reconstruct/fusion/fusion.h"
#include "reconstruct/light/light.h"
#include "reconstruct/pose/lamp_tags.h"
#include "reconstruct/pose/pose.h"
#include "reconstruct/room/mirror_detection.h"
#include "server/pipeline/albedo_schedule.h"
#include "server/pipeline/scene_board.h"

namespace lumigraft::server {
namespace {

/// Runs one stage of a frame: its cost is noted, what it throws becomes a warning.
template <typename Function>
void run_stage(BuildResult& learnt, const std::string& name, Function function) {
  const CostClock clock;
  try {
    function();
  } catch (const std::exception& e) {
    append_warnings(learnt.warnings, {name + ": " + e.what()});
  }
  learnt.stages[name] = clock.elapsed();
}

}  // namespace

struct SceneBuilder::State {
  std::unique_ptr<Oracle> oracle;
  reconstruct::PoseStage pose;
  reconstruct::FusionStage fusion;
  reconstruct::LampTagStage marks;
  reconstruct::LightStage light;
  reconstruct::AlbedoStage albedo;
  reconstruct::EnclosureStage enclosure;
  AlbedoSchedule schedule;
  SceneStore board;

  State(const capture::Session& session, std::unique_ptr<Oracle> the_oracle)
      : oracle(std::move(the_oracle)),
        pose(session.tag, session.color.model, session.color.response),
        fusion(session, reconstruct::FusionSettings{}),
        marks(session),
        light(session, reconstruct::LightSettings{}),
        albedo(session) {}

  OracleParts parts() const { return oracle ? oracle->parts() : OracleParts{}; }

  void solve_albedo(BuildResult& learnt, const std::optional<reconstruct::Pose>& where) {
    const std::shared_ptr<const reconstruct::DistanceField> field = board.newest().field;
    const std::shared_ptr<const reconstruct::Illumination> measured = board.measured_light();
    if (field && measured && schedule.due(*field, *measured)) {
      schedule.begin(field, *measured);
      run_stage(learnt, "albedo", [&] {
        reconstruct::AlbedoStage::Result solution = albedo.solve(*field, *measured);
        schedule.solved(solution.albedo);
        if (parts().light) {
          solution.illumination = measured;
        }
        if (solution.whole && solution.illumination) {
          const std::shared_ptr<const reconstruct::Enclosure> truth =
              parts().geometry ? oracle->enclosure(*solution.illumination) : nullptr;
          board.publish_enclosure(truth ? truth : enclosure.close(*field, *solution.illumination));
          board.publish_warnings("mirrors", reconstruct::mirror_warnings(reconstruct::room_points(*field), *field));
        }
        board.publish_solution(std::move(solution), field->version, measured);
      });
    }
    if (parts().albedo && where && field) {
      run_stage(learnt, "true albedo", [&] { board.publish_albedo(oracle->albedo(learnt.frame, *where, *field)); });
    }
  }
};

SceneBuilder::SceneBuilder(const capture::Session& session, std::unique_ptr<Oracle> oracle)
    : state_(std::make_unique<State>(session, std::move(oracle))) {}

SceneBuilder::~SceneBuilder() = default;

BuildResult SceneBuilder::learn(const capture::FrameSet& sensed) {
  State& s = *state_;
  const OracleParts truth = s.parts();
  BuildResult learnt;
  std::optional<reconstruct::Pose> pose;
  append_warnings(learnt.warnings, sensed.warnings);
  learnt.frame = truth.geometry ? s.oracle->with_true_depth(sensed) : sensed;
  const capture::FrameSet& frame = learnt.frame;

  run_stage(learnt, "pose", [&] {
    if (truth.pose) {
      pose = s.oracle->pose(frame);
      return;
    }
    reconstruct::PoseStage::Result result = s.pose.locate(frame, s.board.newest().field.get());
    pose = result.pose;
    append_warnings(learnt.warnings, result.warnings);
  });
  run_stage(learnt, "light", [&] {
    if (truth.light) {
      s.board.publish_light(s.oracle->illumination(frame));
      return;
    }
    const reconstruct::LampTagStage::Result marked = s.marks.locate(frame, pose);
    append_warnings(learnt.warnings, marked.warnings);
    reconstruct::LightStage::Result result = s.light.extract(frame, marked.marks);
    s.board.publish_light(result.illumination);
    s.board.publish_warnings("light", result.warnings);
  });
  // Depth seen from a pose of the past would smear the field.
  if (pose && pose->age_ns == 0 && frame.depth) {
    run_stage(learnt, "fuse", [&] {
      s.board.publish_field(s.fusion.fuse(frame, *pose));
      s.board.publish_warnings("geometry", s.fusion.warnings());
    });
  }
  s.solve_albedo(learnt, pose);

  learnt.scene = s.board.newest();
  learnt.scene.pose = pose;
  append_warnings(learnt.warnings, learnt.scene.warnings);
  return learnt;
}

}  // namespace lumigraft::server
