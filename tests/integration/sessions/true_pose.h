#pragma once
// True camera poses of sessions.
#include <Eigen/Geometry>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

namespace lumigraft::test {

/// T_tag_camera of frame `index`, or the only one of a static session; empty without truth.
inline std::optional<Eigen::Isometry3d> true_pose(const std::filesystem::path& session, std::uint64_t index) {
  char name[16];
  std::snprintf(name, sizeof(name), "%06u", static_cast<unsigned>(index));
  auto path = session / "truth" / name / "pose.json";
  if (!std::filesystem::exists(path)) path = session / "truth/000000/pose.json";
  std::ifstream in(path);
  if (!in) return std::nullopt;
  const auto rows = nlohmann::json::parse(in)["T_tag_from_camera"];
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) pose.matrix()(r, c) = rows[r][c];
  return pose;
}

}  // namespace lumigraft::test
