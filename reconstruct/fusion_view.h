#pragma once
// A depth picture made ready for fusion: what plane each pixel sees, how far to trust it, and where depth jumps.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "capture/camera_model.h"
#include "capture/image.h"

namespace lumigraft {

/// Axial noise of a structured-light depth camera in metres (Nguyen, Izadi & Lovell 2012, eq. 3; its eq. 2 below 10°).
double depth_sigma_m(double depth_m, double incidence_rad);

/// Pixels of points in the camera's frame, fast: a distorted lens goes through a table.
class PixelMap {
 public:
  explicit PixelMap(const CameraModel& camera);
  Eigen::Vector2f pixel(float x_over_z, float y_over_z) const;

 private:
  static constexpr int kMargin = 32;
  float fx_, fy_, cx_, cy_;
  int width_, height_;
  std::vector<Eigen::Vector2f> table_;  ///< per pixel of the undistorted camera, margin included; empty without lens
};

struct DepthView {
  struct Pixel {
    float plane = 0;   ///< the seen plane's distance from the camera over depth: n · (x/z, y/z, 1)
    float facing = 0;  ///< cosine of incidence
    float weight = 0;  ///< (smallest σ / σ)², at most 1; 0 where no plane is seen
  };
  int width = 0, height = 0;
  std::vector<float> inverse_depth;  ///< 1/m; 0 = nothing measured
  std::vector<Pixel> pixels;
  std::vector<std::uint8_t> smooth;    ///< 1 where (u, v), (u+1, v), (u, v+1), (u+1, v+1) see one surface
  std::vector<std::uint8_t> near_rim;  ///< 1 where this pixel's surface ends within about a voxel, before a farther one
  Image<float> tile_far_m;             ///< largest depth in every tile of kTile² pixels
  static constexpr int kTile = 16;

  std::size_t index(int u, int v) const { return static_cast<std::size_t>(v) * width + u; }
};

/// Prepares depth pictures of one camera.
class DepthPreparation {
 public:
  DepthPreparation(const CameraModel& camera, double voxel_m, double far_m);
  DepthView prepare(const Image<float>& depth_m) const;
  /// x/z, y/z of a pixel's centre.
  const Eigen::Vector2f& ray(int u, int v) const { return rays_[static_cast<std::size_t>(v) * width_ + u]; }

 private:
  void fit_planes(DepthView& view) const;
  void find_rims(DepthView& view) const;

  int width_, height_;
  float focal_, voxel_m_, far_m_;
  static constexpr int kObliqueSteps = 256;
  std::array<float, kObliqueSteps + 1> oblique_{};  ///< angular part of the noise, by cosine of incidence
  std::vector<Eigen::Vector2f> rays_;               ///< NaN where a pixel sees nothing
};

}  // namespace lumigraft
