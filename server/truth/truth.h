#pragma once
// Readers of a session's truth/ folder. Used by `--oracle`, the bench and tests; the running service never reads it.
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/image.h"

namespace lumigraft::server {

struct TrueLamp {
  std::string name;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< tag frame
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    ///< unit, emitting side of a flat lamp; zero for a bulb
  Eigen::Vector3d radiance = Eigen::Vector3d::Zero();  ///< W/sr/m² per channel
  double area_m2 = 0;                                  ///< emitting area
  double radius_m = 0;                                 ///< of a bulb; for a flat lamp, of a disc of equal area
  Eigen::Vector2d size_m = Eigen::Vector2d::Zero();    ///< of a rectangle; zero for others

  /// Projected area from a point: a bulb's disk, a flat lamp's area times the cosine.
  double seen_area_m2(const Eigen::Vector3d& from_m) const;
};

/// Distant light: constant over directions, or truth/environment.exr in the layout of EnvironmentMap.
struct TrueSky {
  Eigen::Vector3d constant = Eigen::Vector3d::Zero();
  bool is_picture = false;
};

/// truth/000007 for frame 7, or truth/000000 where a static session has only that.
std::filesystem::path truth_folder(const std::filesystem::path& session, std::uint64_t index);

// All throw InputError.
Eigen::Isometry3d read_true_pose(const std::filesystem::path& pose_json);
std::vector<TrueLamp> read_true_lamps(const std::filesystem::path& lights_json);
TrueSky read_true_sky(const std::filesystem::path& lights_json);
capture::Image<float> read_true_picture(const std::filesystem::path& exr);  ///< 3 channels
capture::Image<float> read_true_depth(const std::filesystem::path& exr);    ///< 1 channel, metres along the camera's z

}  // namespace lumigraft::server
