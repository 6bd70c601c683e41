// Poses of recorded sessions against their truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "capture/session.h"
#include "capture/source.h"
#include "reconstruct/pose.h"
#include "tests/reconstruct/pose_views.h"

namespace lumigraft {
namespace {

using Eigen::Isometry3d;

/// Of frame `index`, or of the one truth of a session that stands still.
Isometry3d true_pose(const std::filesystem::path& session, std::uint64_t index) {
  char name[16];
  std::snprintf(name, sizeof(name), "%06u", static_cast<unsigned>(index));
  auto path = session / "truth" / name / "pose.json";
  if (!std::filesystem::exists(path)) path = session / "truth/000000/pose.json";
  std::ifstream in(path);
  const auto rows = nlohmann::json::parse(in)["T_tag_from_camera"];
  Isometry3d pose = Isometry3d::Identity();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) pose.matrix()(r, c) = rows[r][c];
  return pose;
}

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

class PoseSessions : public testing::TestWithParam<const char*> {};

TEST_P(PoseSessions, AreNearTheTruth) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  const auto folder = std::filesystem::path(extra ? extra : "") / "sessions" / GetParam();
  if (!extra || !std::filesystem::exists(folder))
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions/" << GetParam();
  const Session session = read_session(ConfigTable::load(folder / "session.toml"));
  const auto frames = open_frames(session);
  PoseStage stage(session.tag, session.color.model, session.color.response);
  std::vector<double> smooth_mm, smooth_deg, raw_mm, raw_deg;
  while (const auto frame = frames->next(std::chrono::seconds(1))) {
    const auto result = stage.locate(*frame);
    ASSERT_TRUE(result.pose) << frame->index;
    EXPECT_TRUE(result.warnings.empty()) << frame->index << ": " << result.warnings[0];
    const Isometry3d truth = true_pose(folder, frame->index);
    smooth_mm.push_back(test::millimetres_apart(result.pose->T_tag_camera, truth));
    smooth_deg.push_back(test::degrees_apart(result.pose->T_tag_camera, truth));
    raw_mm.push_back(test::millimetres_apart(result.pose->T_tag_camera_raw, truth));
    raw_deg.push_back(test::degrees_apart(result.pose->T_tag_camera_raw, truth));
  }
  ASSERT_FALSE(smooth_mm.empty());
  std::printf(
      "pose: %-16s %2zu frames  median / 95%%: %.2f / %.2f mm, %.3f / %.3f deg   raw %.2f / %.2f mm, %.3f / %.3f deg\n",
      GetParam(), smooth_mm.size(), percentile(smooth_mm, 0.5), percentile(smooth_mm, 0.95),
      percentile(smooth_deg, 0.5), percentile(smooth_deg, 0.95), percentile(raw_mm, 0.5), percentile(raw_mm, 0.95),
      percentile(raw_deg, 0.5), percentile(raw_deg, 0.95));
  EXPECT_LT(percentile(smooth_mm, 1), 3);
  EXPECT_LT(percentile(smooth_deg, 1), 0.2);
}

INSTANTIATE_TEST_SUITE_P(All, PoseSessions,
                         testing::Values("box-with-inside", "brushed-metal", "cornell", "tabletop", "tabletop-orbit"),
                         [](const auto& session) {
                           std::string name = session.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace lumigraft
