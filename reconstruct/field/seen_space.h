#pragma once
// Space through which a depth camera looked, and what surfaces hid from it.
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace lumigraft::reconstruct {

/// The nearest depth around every direction of one image. What is within about two pixels of the outline of a near
/// surface counts as hidden by it: something thin, seen edge-on, may be there and nobody can tell.
class SeenSpace {
 public:
  /// `rays`: x/z and y/z of each pixel of `width` columns, NaN where there is none; `inverse_depth`: 1/m along the
  /// camera's z, 0 where nothing was measured; `voxel_m`: accuracy of surfaces.
  SeenSpace(std::span<const Eigen::Vector2f> rays, std::span<const float> inverse_depth, int width,
            const Eigen::Isometry3f& T_tag_camera, float voxel_m);

  /// Whether a surface hid the point (tag frame, metres); empty outside the image and where nothing was measured.
  std::optional<bool> hides(const Eigen::Vector3f& position_m) const;

 private:
  void measure(std::span<const Eigen::Vector2f> rays, std::span<const float> inverse_depth);
  void fill_unmeasured();
  void spread_near_surfaces();
  std::vector<float> nearest_around() const;  ///< of the 3 × 3 cells around each; infinite if none is measured

  Eigen::Isometry3f T_camera_tag_;
  float margin_m_;
  int columns_, rows_ = 0;
  Eigen::Vector2f low_ = Eigen::Vector2f::Zero(), per_tangent_ = Eigen::Vector2f::Zero();
  std::vector<float> depth_m_;  ///< nearest, per cell of the tangent plane; 0 = not measured
};

/// Whether surfaces hid the point from each camera that had it in its image, and one had.
bool hidden_from_all(const std::vector<std::shared_ptr<const SeenSpace>>& views, const Eigen::Vector3f& position_m);

}  // namespace lumigraft::reconstruct
