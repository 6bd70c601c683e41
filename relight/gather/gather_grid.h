#pragma once
// The change of indirect light at pixels: gathered for one of scale² pixels, smoothed over like surfaces (Dammertz et
// al. 2010, edge-avoiding à-trous), brought to every pixel by joint bilateral upsampling (Kopf et al. 2007).
#include <array>
#include <limits>

#include "relight/gather/gbuffer.h"
#include "relight/gather/surface_gather.h"

namespace lumigraft::relight {

/// For one kind of the surfaces that a camera sees, as long as it sees them.
class GatherGrid {
 public:
  enum class Of { even, glossy };

  /// Keeps references to `seen`, by pixel of `camera`. `scale`: edge of the squares of pixels of which one is gathered
  /// for.
  GatherGrid(const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera, int scale, Of kind);

  /// `places`: where light changes. `rays`: of a pixel. `turn`: which of the squares get new light; they are
  /// numbered from 0 to 7 in patterns of 4 × 2.
  void gather(const DeltaLight& light, const std::vector<ChangeRegion>& places, int rays, std::uint32_t seed,
              const UpdateSubset& turn);

  /// By pixel, of three channels. Even surfaces: signed change of irradiance without what lamps bring themselves, W/m².
  /// Glossy ones: the whole change of radiance that they send to the camera, W/sr/m². 0 for all others.
  std::vector<Eigen::Array4f> at_pixels() const;

 private:
  struct Cell {
    int pixel = -1;                                         ///< that it was gathered for
    float near_m = std::numeric_limits<float>::infinity();  ///< within which its light changes little
    float pixel_m = 0;  ///< how much of the surface's depth a pixel of the grid spans
    Rgb light = Rgb::Zero();
  };

  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  const SurfaceHit& surface(const Cell& cell) const { return seen_[static_cast<std::size_t>(cell.pixel)].surface; }
  bool is_meant(const GBufferPixel& p) const { return p.known && p.glossy == (kind_ == Of::glossy); }
  void choose_pixel(int x, int y);
  std::array<float, 9> shares_around(int u, int v, const SurfaceHit& own) const;
  std::vector<Eigen::Array4f> smoothed() const;

  const std::vector<GBufferPixel>& seen_;
  capture::CameraModel camera_;
  int scale_;
  Of kind_;
  int width_, height_;
  std::vector<Cell> cells_;
  std::vector<std::array<float, 9>> shares_;  ///< by pixel: what it takes of the cells around it, row by row
};

}  // namespace lumigraft::relight
