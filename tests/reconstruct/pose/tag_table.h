#pragma once
// Images of a table with two tags.
#include <Eigen/Geometry>
#include <algorithm>

#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::test {

inline Eigen::Isometry3d lying_at(const Eigen::Vector3d& place_m, double turn_rad) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = place_m;
  T.linear() = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

inline const Eigen::Isometry3d kSecondTag = lying_at({0.28, 0.05, 0.0}, 0.4);

/// Tag 2 at the origin and, if `second`, tag 5 next to it.
struct TagTable {
  bool first = true, second = true;
  double size_m = 0.16;
  int second_id = 5;
  Eigen::Isometry3d T_tag_second = kSecondTag;

  /// Whether the second tag is nearer to the pixel's point on the table.
  bool is_of_second(const capture::CameraModel& camera, const Eigen::Isometry3d& T_tag_camera, int u, int v) const {
    const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
    const Eigen::Vector3d d = T_tag_camera.linear() * *ray, from = T_tag_camera.translation();
    const Eigen::Vector3d p = from - from.z() / d.z() * d;
    return (p - T_tag_second.translation()).norm() < p.norm();
  }

  capture::FrameSet seen_from(const Eigen::Isometry3d& T_tag_camera, std::uint64_t index, double code_sigma = 1) const {
    const reconstruct::TagFinder finder(capture::Tag{"tag36h11", 2, 0.16, {{5, 0.16, std::nullopt}}});
    const capture::CameraModel camera = small_camera();
    const ViewNoise noise{code_sigma, static_cast<unsigned>(index) + 1};
    capture::Frame picture = view_of_tag(camera, finder.pattern(), size_m, T_tag_camera, noise);
    const capture::Frame other =
        view_of_tag(camera, finder.pattern(second_id == 5 ? 1 : 0), 0.16, T_tag_second.inverse() * T_tag_camera, noise);
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        const bool to_second = is_of_second(camera, T_tag_camera, u, v);
        if (to_second && second) std::copy_n(&other.encoded.at(u, v), 3, &picture.encoded.at(u, v));
        if ((to_second && !second) || (!to_second && !first)) std::fill_n(&picture.encoded.at(u, v), 3, 130);
      }
    return frame_of(std::move(picture), index, static_cast<std::int64_t>(index) * kFrameNs);
  }
};

inline Eigen::Isometry3d above_the_table(unsigned index) {
  return looking_at_tag(0.9, 45 * kDegree, -1.4 + 0.01 * index, {0.12, 0.03, 0});
}

}  // namespace lumigraft::test
