// CPU time of the camera's pose on every frame of a recording, played back and forth at 30 frames per second with every
// third frame fused, as `serve` does; and its errors where the recording has true poses.
//
//   build/release/pose_time SESSION [FRAMES]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "capture/session/session.h"
#include "capture/source.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::test {
namespace {

constexpr std::size_t kLearning = 32, kFusedEvery = 3;  // frames
constexpr double kFramesPerSecond = 30;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

/// Of a frame, or of the first if the camera rests; empty without truth.
std::optional<Eigen::Isometry3d> true_pose(const std::filesystem::path& session, std::uint64_t index) {
  char name[32];
  std::snprintf(name, sizeof(name), "%06llu", static_cast<unsigned long long>(index));
  auto path = session / "truth" / name / "pose.json";
  if (!std::filesystem::exists(path)) path = session / "truth/000000/pose.json";
  if (!std::filesystem::exists(path)) return std::nullopt;
  std::ifstream in(path);
  const auto rows = nlohmann::json::parse(in)["T_tag_from_camera"];
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) pose(r, c) = rows[r][c].get<double>();
  return pose;
}

void print(const char* name, std::vector<double> values) {
  if (values.empty()) return;
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (const double value : values) sum += value;
  std::printf("%-22s median %8.3f, 95 %% %8.3f, max %8.3f, mean %8.3f\n", name, values[values.size() / 2],
              values[values.size() * 95 / 100], values.back(), sum / static_cast<double>(values.size()));
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
  reconstruct::PoseStage stage(session.tag, session.color.model, session.color.response, session.depth_noise(),
                               session.color.readout_s);
  reconstruct::FusionStage fusion(session, reconstruct::FusionSettings{});
  std::shared_ptr<const reconstruct::DistanceField> field;
  std::vector<double> ms, position_mm, angle_deg;
  std::size_t by_tag = 0, located = 0;
  const std::size_t turn = std::max<std::size_t>(1, 2 * (frames.size() - 1));
  for (std::size_t i = 0; i < kLearning + count; ++i) {
    const std::size_t along = i % turn, source = std::min(along, turn - along) % frames.size();
    capture::FrameSet frame = frames[source];
    frame.index = i;
    frame.time_ns = static_cast<std::int64_t>(1e9 * static_cast<double>(i) / kFramesPerSecond);
    const double start_ms = cpu_ms();
    const auto pose = stage.locate(frame, field.get()).pose;
    const double spent_ms = cpu_ms() - start_ms;
    if (pose && pose->age_ns == 0 && frame.depth && i % kFusedEvery == 0) field = fusion.fuse(frame, *pose);
    if (i < kLearning) continue;
    ms.push_back(spent_ms);
    if (!pose) continue;
    ++located;
    by_tag += pose->from == reconstruct::Pose::From::tag;
    if (!truths[source]) continue;
    const Eigen::Isometry3d error = truths[source]->inverse() * pose->T_tag_camera;
    position_mm.push_back(1e3 * (pose->T_tag_camera.translation() - truths[source]->translation()).norm());
    angle_deg.push_back(180 / M_PI * Eigen::AngleAxisd(error.linear()).angle());
  }
  std::printf("%zu frames, %zu located, %zu by a tag\n", count, located, by_tag);
  print("CPU ms", ms);
  print("position error, mm", position_mm);
  print("angle error, degrees", angle_deg);
}

}  // namespace
}  // namespace lumigraft::test

int main(int count, char** words) {
  if (count < 2 || count > 3) {
    std::fprintf(stderr, "pose_time SESSION [FRAMES]\n");
    return 2;
  }
  try {
    lumigraft::test::measure(words[1], count > 2 ? std::strtoul(words[2], nullptr, 10) : 192);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
}
