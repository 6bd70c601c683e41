#pragma once
// The change of indirect light at pixels: gathered for one of scale² pixels, filtered over similar surfaces (Dammertz
// et al. 2010, edge-avoiding à-trous), and interpolated to all pixels by joint bilateral upsampling (Kopf et al. 2007).
#include <array>
#include <limits>

#include "relight/gather/gbuffer.h"
#include "relight/gather/surface_gather.h"

namespace lumigraft::relight {

/// For one kind of surface in a camera view, as long as the view does not change.
class GatherGrid {
 public:
  enum class Of { even, glossy };

  /// Keeps references to `seen`, per pixel of `camera`. `scale`: edge of the pixel squares with one gathered pixel
  /// each.
  GatherGrid(const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera, int scale, Of kind);

  /// `places`: regions where light changes. `rays`: per pixel; glossy ones send up to kGather.gloss_rounds times as
  /// many, until the standard error is below `step_radiance`, W/sr/m². `turn`: the subset of squares to update; they
  /// are numbered from 0 to 7 in patterns of 4 × 2.
  void gather(const DeltaLight& light, const std::vector<ChangeRegion>& places, int rays, float step_radiance,
              std::uint32_t seed, const UpdateSubset& turn);

  /// Per pixel, three channels. Matt surfaces: signed change of irradiance without the lamps' direct light, W/m².
  /// Glossy surfaces: the whole change of the radiance they send to the camera, W/sr/m². 0 for all others.
  std::vector<Eigen::Array4f> at_pixels() const;

 private:
  struct Cell {
    int pixel = -1;                                         ///< the gathered pixel
    float near_m = std::numeric_limits<float>::infinity();  ///< distance within which its light changes little
    float pixel_m = 0;                                      ///< depth range of the surface within a pixel of the grid
    Rgb light = Rgb::Zero();
  };

  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  const SurfaceHit& surface(const Cell& cell) const { return seen_[static_cast<std::size_t>(cell.pixel)].surface; }
  bool is_meant(const GBufferPixel& p) const { return p.known && p.glossy == (kind_ == Of::glossy); }
  void choose_pixel(int x, int y);
  std::array<float, 9> weights_around(int u, int v, const SurfaceHit& own) const;
  std::vector<Eigen::Array4f> smoothed() const;

  const std::vector<GBufferPixel>& seen_;
  capture::CameraModel camera_;
  int scale_;
  Of kind_;
  int width_, height_;
  std::vector<Cell> cells_;
  std::vector<std::array<float, 9>> weights_;  ///< per pixel: weights of the cells around it, row by row
};

}  // namespace lumigraft::relight
