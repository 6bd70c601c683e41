#pragma once
// A fish-eye picture resampled to latitude and longitude, and such a picture's spherical harmonics.
#include <cstdint>
#include <vector>

#include "reconstruct/light/fisheye_rays.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Which fish-eye pixels make up which cell of the latitude-longitude picture; computed once per camera.
class EnvironmentResampler {
 public:
  EnvironmentResampler(const capture::FisheyeCamera& camera, const FisheyeView& view, int width, int height);

  /// Means over cells. The seen part is scaled per channel so that it integrates to the picture exactly; unseen cells
  /// take the mean of the seen cells nearest to them. `clipped`, where there is one, has one channel, not 0 where a
  /// pixel's radiance is a lower bound; cells of such pixels are marked.
  EnvironmentMap resample(const capture::Image<float>& radiance, const FisheyeView& view,
                          const capture::Image<std::uint8_t>* clipped = nullptr) const;

 private:
  int width_, height_;
  std::vector<float> cell_solid_angle_;       ///< per row
  std::vector<float> seen_share_;             ///< per cell: part of it that the fish-eye sees
  std::vector<std::uint32_t> pixel_begin_;    ///< per cell and one more: range in pixels_
  std::vector<std::uint32_t> pixels_;         ///< one fish-eye pixel per sub-sample
  std::vector<std::uint32_t> unseen_;         ///< cells no sub-sample of which is seen
  std::vector<std::uint32_t> nearest_begin_;  ///< per unseen cell and one more: range in nearest_
  std::vector<std::uint32_t> nearest_;        ///< seen cells
};

Eigen::Vector3f environment_direction(int u, int v, int width, int height);  ///< of a cell's centre
float environment_solid_angle_sr(int v, int width, int height);              ///< of a cell in row v
/// Adds a disk of even radiance that integrates to `energy` (L dω per channel).
void add_disk(EnvironmentMap& picture, const Eigen::Vector3f& direction, float radius_rad,
              const Eigen::Vector3f& energy);
Sh9 project_sh(const EnvironmentMap& picture);

}  // namespace lumigraft::reconstruct
