#include "server/bench/bench_session.h"

#include <utility>

#include "capture/error.h"
#include "capture/source.h"
#include "reconstruct/math/median.h"
#include "reconstruct/scene_store.h"
#include "server/pipeline/camera_picture.h"
#include "server/truth/truth.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

std::shared_ptr<Oracle> make_oracle(const capture::Session& session, const OracleParts& parts) {
  return parts.any() ? std::make_shared<Oracle>(session, parts) : nullptr;
}

/// Whether a frame can be scored and truth/ has these parts.
bool has_truth(const fs::path& truth, const OracleParts& needed) {
  return fs::exists(truth / "augmented.exr") && (!needed.pose || fs::exists(truth / "pose.json")) &&
         (!needed.geometry || fs::exists(truth / "depth.exr")) &&
         (!needed.light || fs::exists(truth / "lights.json")) && (!needed.albedo || fs::exists(truth / "albedo.exr"));
}

/// The last such frame among the first kBenchFrames.
std::uint64_t last_with_truth(const fs::path& session, const OracleParts& needed) {
  std::uint64_t last = 0;
  for (std::uint64_t i = 0; i < kBenchFrames; ++i) last = has_truth(truth_folder(session, i), needed) ? i : last;
  return last;
}

std::map<std::string, reconstruct::StageCost> medians(
    const std::map<std::string, std::vector<reconstruct::StageCost>>& runs) {
  std::map<std::string, reconstruct::StageCost> result;
  for (const auto& [name, costs] : runs) {
    std::vector<double> wall_ms, cpu_ms;
    for (const reconstruct::StageCost& cost : costs) {
      wall_ms.push_back(cost.wall_ms);
      cpu_ms.push_back(cost.cpu_ms);
    }
    result[name] = {reconstruct::median(wall_ms), reconstruct::median(cpu_ms)};
  }
  return result;
}

}  // namespace

ServiceInput open_bench_session(const fs::path& folder, const OracleParts& oracle) {
  ServiceInput input = read_service({.config = {}, .session = folder, .exhibit = {}, .overrides = {}}, replay_plan());
  capture::refuse_if(!fs::exists(truth_folder(input.session.folder, 0) / "augmented.exr"),
                     folder.string() + ": found no truth/000000/augmented.exr, allowed: a session with truth");
  capture::refuse_if(input.exhibit.objects.empty(),
                     folder.string() + ": found no object, allowed: a session with an exhibit.toml");
  capture::open_paired_frames(input.session);
  make_oracle(input.session, oracle);
  return input;
}

BenchScene learn_bench_scene(const capture::Session& session, const OracleParts& oracle, const OracleParts& needed) {
  const std::unique_ptr<capture::FrameReader> frames = capture::open_paired_frames(session);
  reconstruct::SceneBuilder builder(session, overrides_of(make_oracle(session, oracle)));
  BenchScene result;
  fs::path truth;
  std::map<std::string, std::vector<reconstruct::StageCost>> runs;
  const std::uint64_t last = last_with_truth(session.folder, needed);
  while (const std::optional<capture::FrameSet> frame = frames->next(std::chrono::seconds(10))) {
    if (frame->index > last) break;
    reconstruct::BuildResult built = builder.build(*frame);
    reconstruct::append_warnings(result.warnings, built.warnings);
    for (const auto& [name, cost] : built.stages) runs[name].push_back(cost);
    if (const fs::path folder = truth_folder(session.folder, frame->index); has_truth(folder, needed)) {
      truth = folder;
      result.frame = std::move(built.frame);
      result.scene = std::move(built.scene);
    }
  }
  capture::refuse_if(truth.empty(), session.folder.string() + ": no colour picture that has truth can be read");
  result.camera = camera_picture(*result.frame.color);
  result.truth = read_true_pictures(truth, session.color.exposure);
  result.stages = medians(runs);
  return result;
}

}  // namespace lumigraft::server
