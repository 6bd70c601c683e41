// CPU time of every stage of reconstruct on every frame of a recording, played back and forth at 30 frames per second.
// All stages run on every frame except albedo, solved every eighth frame while the room is being reconstructed and
// every 32nd afterwards, incrementally where possible ("new"). Where the recording has true poses, also errors.
//
//   build/release/reconstruct_time SESSION [FRAMES]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "capture/source.h"
#include "reconstruct/albedo/albedo.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/light/light.h"
#include "reconstruct/pose/pose.h"
#include "tests/integration/sessions/true_pose.h"

namespace lumigraft::test {
namespace {

constexpr std::size_t kLearning = 32, kSolveThen = 8, kSolveLater = 32;  // frames
constexpr double kFramesPerSecond = 30;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

class Stages {
 public:
  explicit Stages(const capture::Session& session)
      : pose_(session.tag, session.color.model, session.color.response, session.depth_noise(), session.color.readout_s),
        light_(session),
        fusion_(session, reconstruct::FusionSettings{}),
        albedo_(session) {}

  /// `truth`: empty if it is not known.
  void learn(const capture::FrameSet& frame, const std::optional<Eigen::Isometry3d>& truth, std::size_t count) {
    std::optional<reconstruct::Pose> pose;
    timed("pose", [&] { pose = pose_.locate(frame, field_.get()).pose; });
    if (pose && truth) {
      const Eigen::Isometry3d error = truth->inverse() * pose->T_tag_camera;
      position_mm.push_back(1e3 * error.translation().norm());
      angle_deg.push_back(180 / M_PI * Eigen::AngleAxisd(error.linear()).angle());
    }
    timed("light", [&] { measured_ = light_.extract(frame).illumination; });
    if (!pose || pose->age_ns != 0 || !frame.depth) return;
    timed("fusion", [&] { field_ = fusion_.fuse(frame, *pose); });
    if (!field_ || !measured_) return;
    if (count % (count < kLearning ? kSolveThen : kSolveLater) != 0) return;
    const double start_ms = cpu_ms();
    solved_ = albedo_.solve(*field_, *measured_);
    times_ms[solved_.complete ? "albedo" : "new"].push_back(cpu_ms() - start_ms);
  }

  void forget_measurements() {
    times_ms.clear();
    position_mm.clear();
    angle_deg.clear();
  }

  std::map<std::string, std::vector<double>> times_ms;
  std::vector<double> position_mm, angle_deg;  ///< errors of poses

 private:
  template <typename Function>
  void timed(const char* name, Function stage) {
    const double start_ms = cpu_ms();
    stage();
    times_ms[name].push_back(cpu_ms() - start_ms);
  }

  reconstruct::PoseStage pose_;
  reconstruct::LightStage light_;
  reconstruct::FusionStage fusion_;
  reconstruct::AlbedoStage albedo_;
  std::shared_ptr<const reconstruct::DistanceField> field_;
  std::shared_ptr<const reconstruct::Illumination> measured_;
  reconstruct::AlbedoStage::Result solved_;
};

void print_errors(const char* name, std::vector<double> values) {
  if (values.empty()) return;
  std::sort(values.begin(), values.end());
  std::printf("errors of poses, %s: median %.3f, 95 %% %.3f\n", name, values[values.size() / 2],
              values[values.size() * 95 / 100]);
}

void measure(const std::filesystem::path& folder, std::size_t count) {
  const capture::Session session = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
  const auto reader = capture::open_frames(session);
  std::vector<capture::FrameSet> frames;
  std::vector<std::optional<Eigen::Isometry3d>> truths;
  while (auto frame = reader->next(std::chrono::seconds(1))) {
    truths.push_back(true_pose(folder, frame->index));
    frames.push_back(std::move(*frame));
  }
  if (frames.empty()) return;
  Stages stages(session);
  const std::size_t turn = std::max<std::size_t>(1, 2 * (frames.size() - 1));
  for (std::size_t i = 0; i < kLearning + count; ++i) {
    if (i == kLearning) stages.forget_measurements();
    const std::size_t along = i % turn, source = std::min(along, turn - along) % frames.size();
    capture::FrameSet frame = frames[source];
    frame.index = i;
    frame.time_ns = static_cast<std::int64_t>(1e9 * static_cast<double>(i) / kFramesPerSecond);
    stages.learn(frame, truths[source], i);
  }
  double all_ms = 0;
  for (auto& [name, ms] : stages.times_ms) {
    double sum_ms = 0;
    for (const double one : ms) sum_ms += one;
    all_ms += sum_ms;
    std::sort(ms.begin(), ms.end());
    std::printf("%-8s %4zu times, CPU ms: median %6.2f, mean %6.2f, max %6.1f; a frame %6.2f\n", name.c_str(),
                ms.size(), ms[ms.size() / 2], sum_ms / static_cast<double>(ms.size()), ms.back(),
                sum_ms / static_cast<double>(count));
  }
  const double a_frame_ms = all_ms / static_cast<double>(count);
  std::printf("a frame %.1f, at %.0f frames a second %.0f %% of two cores\n", a_frame_ms, kFramesPerSecond,
              100 * 1e-3 * a_frame_ms * kFramesPerSecond / 2);
  print_errors("mm", stages.position_mm);
  print_errors("degrees", stages.angle_deg);
}

}  // namespace
}  // namespace lumigraft::test

int main(int count, char** words) {
  if (count < 2 || count > 3) {
    std::fprintf(stderr, "reconstruct_time SESSION [FRAMES]\n");
    return 2;
  }
  try {
    lumigraft::test::measure(words[1], count > 2 ? std::strtoul(words[2], nullptr, 10) : 192);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
}
