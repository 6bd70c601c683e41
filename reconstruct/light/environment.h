#pragma once
// Rays of the fish-eye's pixels, resampling of its image to a latitude-longitude map, and spherical harmonics of such a
// map.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Direction and solid angle of each pixel of the fish-eye.
struct FisheyeView {
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector3f> direction;  ///< unit, tag frame; zero outside the lens's image
  std::vector<float> solid_angle_sr;       ///< 0 outside the lens's image

  bool sees(std::size_t pixel) const { return solid_angle_sr[pixel] > 0; }
};

FisheyeView fisheye_view(const capture::FisheyeCamera& camera);

/// Table of the fish-eye pixels in each cell of the map, computed once per camera.
class EnvironmentResampler {
 public:
  EnvironmentResampler(const capture::FisheyeCamera& camera, const FisheyeView& view, int width, int height);

  /// Mean radiance per cell. Cells inside the view are scaled per channel so that they integrate to the image exactly;
  /// cells outside take the mean of the nearest cells inside. `clipped` (may be null) has one channel, not 0 where a
  /// pixel's radiance is a lower bound; cells with such pixels are marked.
  EnvironmentMap resample(const capture::Image<float>& radiance, const FisheyeView& view,
                          const capture::Image<std::uint8_t>* clipped = nullptr) const;

 private:
  int width_, height_;
  std::vector<float> cell_solid_angle_;       ///< per row
  std::vector<float> seen_fraction_;          ///< per cell: fraction inside the view
  std::vector<std::uint32_t> pixel_begin_;    ///< per cell and one more: range in pixels_
  std::vector<std::uint32_t> pixels_;         ///< one fish-eye pixel per sub-sample
  std::vector<std::uint32_t> unseen_;         ///< cells without any sub-sample in the view
  std::vector<std::uint32_t> nearest_begin_;  ///< per unseen cell and one more: range in nearest_
  std::vector<std::uint32_t> nearest_;        ///< seen cells
};

Eigen::Vector3f environment_direction(int u, int v, int width, int height);  ///< of the cell's centre, unit
float environment_solid_angle_sr(int v, int width, int height);              ///< of a cell in row v
/// Adds a disk of uniform radiance that integrates to `energy` (∫ L dω per channel).
void add_disk(EnvironmentMap& map, const Eigen::Vector3f& direction, float radius_rad, const Eigen::Vector3f& energy);
Sh9 project_sh(const EnvironmentMap& map);

}  // namespace lumigraft::reconstruct
