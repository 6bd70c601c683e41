#pragma once
// Files of a session's truth/ folder. For `--oracle` and tests alone; the running service never reads them.
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
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    ///< unit, of a flat lamp's lit side; zero for a bulb
  Eigen::Vector3d radiance = Eigen::Vector3d::Zero();  ///< W/sr/m² per channel
  double area_m2 = 0;                                  ///< lit
  double radius_m = 0;                                 ///< of a bulb; of a disc as large, for a flat lamp
  Eigen::Vector2d size_m = Eigen::Vector2d::Zero();    ///< of a rectangle; zero for others

  /// Area seen from a point: a bulb's disk, a flat lamp's area times its cosine.
  double seen_area_m2(const Eigen::Vector3d& from_m) const;
};

/// Light from far away: the same from everywhere, or truth/environment.exr, laid out as EnvironmentMap is.
struct TrueSky {
  Eigen::Vector3d constant = Eigen::Vector3d::Zero();
  bool is_picture = false;
};

/// truth/000007 for a frame of that index, or truth/000000 where the session stands still and has no other.
std::filesystem::path truth_folder(const std::filesystem::path& session, std::uint64_t index);

// All throw InputError.
Eigen::Isometry3d read_true_pose(const std::filesystem::path& pose_json);
std::vector<TrueLamp> read_true_lamps(const std::filesystem::path& lights_json);
TrueSky read_true_sky(const std::filesystem::path& lights_json);
capture::Image<float> read_true_picture(const std::filesystem::path& exr);  ///< 3 channels
capture::Image<float> read_true_depth(const std::filesystem::path& exr);    ///< 1 channel, metres along the camera's z

}  // namespace lumigraft::server
