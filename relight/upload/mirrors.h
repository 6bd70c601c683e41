#pragma once
// Flat pieces of real surfaces with known material, and the lamps whose light they reflect to the objects. A lamp
// reflected by a plane mirror acts as a lamp at its mirror image, blurred by the surface's roughness: the radiance that
// the camera measured on the mirror does not contain this light, which leaves in other directions.
#include <memory>
#include <vector>

#include "capture/session/session.h"
#include "relight/gpu/device.h"
#include "relight/objects/flat_pieces.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

class Mirrors {
 public:
  explicit Mirrors(gpu::Device& device);

  /// Adds the flat pieces of a surface; the largest kMaxMirrors of all surfaces are kept. `number`: index into
  /// FrameParams::surfaces.
  void add(gpu::Device& device, const Model& model, const capture::RealSurface& surface, int number);

  /// Fills params.mirrors, mirror_counts and images for the lamps and the sphere around the objects in `params`.
  void describe(shader::FrameParams& params) const;

  const gpu::Texture& outlines() const { return *outlines_; }  ///< masks stacked vertically, 1: mirror

 private:
  struct Piece {
    FlatPiece flat;
    int surface = 0;
    Eigen::Vector3f f0, f90;
    float alpha = 1;
  };

  std::vector<Piece> pieces_;
  std::unique_ptr<gpu::Texture> outlines_;
};

}  // namespace lumigraft::relight
