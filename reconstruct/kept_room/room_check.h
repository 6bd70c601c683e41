#pragma once
// Whether the camera sees the room that was kept. Something may have moved while the program did not run; where most of
// what is seen contradicts the kept surfaces, it is another room, or the tag that defines its frame was moved.
#include <Eigen/Geometry>
#include <cstdint>

#include "capture/image.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/pose/depth_points.h"

namespace lumigraft::reconstruct {

class RoomCheck {
 public:
  explicit RoomCheck(const capture::CameraModel& camera, const capture::DepthNoise& noise = {})
      : sampler_(camera, noise), noise_(noise) {}

  enum class Verdict { undecided, same, another };
  /// Compares a depth image with the kept surfaces that its rays meet first. Where both are in the plane of the tag,
  /// z = 0, they count only if there are few others. The room is the same as soon as most points of one image are on
  /// its surfaces; it is another one after KeptRoomParameters::Check::max_contradictions images, half a second apart,
  /// in which they are not.
  Verdict look(const DistanceField& kept, const capture::Image<float>& depth_m, const Eigen::Isometry3f& T_tag_camera,
               std::int64_t time_ns);

  /// In the last image that was compared.
  struct Points {
    int on_surface = 0, elsewhere = 0;
    int all() const { return on_surface + elsewhere; }
    void add(bool is_on_surface) { ++(is_on_surface ? on_surface : elsewhere); }
  };
  Points points() const { return points_; }
  /// Whether for long no image showed enough of the kept surfaces.
  bool sees_too_little() const;

 private:
  Points count(const DistanceField& kept, const DepthGrid& grid, const Eigen::Isometry3f& T_tag_camera) const;

  DepthSampler sampler_;
  capture::DepthNoise noise_;
  Points points_;
  std::int64_t last_ns_ = 0;
  int looks_ = 0, told_ = 0, contradictions_ = 0;  ///< images compared, those with enough points, contradicting ones
};

}  // namespace lumigraft::reconstruct
