#pragma once
// Depth for sessions whose depth camera is missing: of the planes in which the room's tags lie.
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::reconstruct {

/// A tag lies on a surface: its plane continues around it as long as the image shows the same colour without an edge
/// (seeded region growing, Adams & Bischof 1994), within some sizes of the tag. The rest of the image gets no depth.
/// The colours around the tag give the surface's hue and how much its texture varies, so a floor of many colours ends
/// where its tag's reach does. Of several planes the nearest counts.
///
/// This depth is no measurement: stages that compare depth with something else must not see it.
class TagPlanes {
 public:
  explicit TagPlanes(const capture::Session& session);

  /// The frame with the depth of the planes, if the session's depth camera is missing or has delivered nothing for
  /// awaited_ns; else the frame. After the first measured depth there is never another one.
  capture::FrameSet complete(const capture::FrameSet& frame, const std::optional<Pose>& pose);
  /// What is unknown because of it; as of the last frame.
  std::vector<std::string> warnings() const;

 private:
  struct Plane {
    Eigen::Isometry3d T_tag_plane;  ///< the tag's own frame: z out of the paper
    float size_m;                   ///< of the tag
  };
  /// Square of pixels.
  struct Block {
    Eigen::Vector3f log_color;  ///< of the mean
    Eigen::Vector2f ray;        ///< x/z, y/z of its centre; NaN where the lens model has no ray
  };
  void measure_colors(const capture::Frame& color);
  std::vector<char> surface_around(const Plane& plane, const Eigen::Isometry3f& T_camera_plane) const;
  void add_depth(const Plane& plane, const Eigen::Isometry3f& T_camera_plane, capture::Image<float>& depth_m) const;

  capture::ColorCamera camera_;
  int block_px_, columns_, rows_;
  std::vector<Eigen::Vector2f> rays_;  ///< per pixel, as Block::ray
  std::vector<Block> blocks_;
  std::vector<Plane> planes_;
  bool awaited_, measured_ = false;
  std::optional<std::int64_t> first_ns_;
};

}  // namespace lumigraft::reconstruct
