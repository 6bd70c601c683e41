#pragma once
// Flat pieces of known real surfaces, and the lamps whose light they send on to the objects. A lamp that shines into a
// looking glass shines out of it again from its image's place, blurred by the glass's roughness: the radiance that the
// camera saw on the glass says nothing of it, since it goes elsewhere.
#include <memory>
#include <vector>

#include "capture/session/session.h"
#include "relight/gpu/device.h"
#include "relight/objects/flat_pieces.h"

namespace lumigraft::relight {

class Mirrors {
 public:
  explicit Mirrors(gpu::Device& device);

  /// The flat pieces of one more surface; the largest kMaxMirrors of all are kept. `number` as in
  /// FrameParams::surfaces.
  void add(gpu::Device& device, const Model& model, const capture::RealSurface& surface, int number);

  /// Fills params.mirrors, mirror_counts and images for the lamps and the sphere around the objects that are there.
  void describe(shader::FrameParams& params) const;

  const gpu::Texture& outlines() const { return *outlines_; }  ///< one above the other, 1: mirror

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
