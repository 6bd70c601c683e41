#pragma once
// The flat pieces of a model: where a known real surface mirrors like a looking glass, however rough.
#include <vector>

#include "relight/exhibit/exhibit.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

struct FlatPiece {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit, on the side of the vertices' normals
  float offset_m = 0;                                 ///< normal · p on the plane
  float area_m2 = 0;
  Eigen::Vector3f centre_m = Eigen::Vector3f::Zero();        ///< of the rectangle around the piece
  Eigen::Vector3f half_along_m = Eigen::Vector3f::UnitX();   ///< from the centre to the middle of an edge
  Eigen::Vector3f half_across_m = Eigen::Vector3f::UnitY();  ///< at right angles to it
  bool two_sided = false;                                    ///< of a sheet: nobody knows which side is seen
  std::vector<std::uint8_t> outline;  ///< kOutline² texels over the rectangle, rows across: 255 where the piece is
};

/// Largest first, at most kMaxMirrors. Pieces smaller than a hand's breadth or a fiftieth of the model are left out,
/// and so are facets of what is meant to be curved, whose vertices' normals differ from the facet's.
std::vector<FlatPiece> flat_pieces(const Model& model);

}  // namespace lumigraft::relight
