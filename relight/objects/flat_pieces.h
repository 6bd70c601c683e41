#pragma once
// Finds the flat pieces of a model, where a known real surface acts as a plane mirror of any roughness.
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

struct FlatPiece {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit, on the side of the vertices' normals
  float offset_m = 0;                                 ///< plane equation: normal · p = offset_m
  float area_m2 = 0;
  Eigen::Vector3f centre_m = Eigen::Vector3f::Zero();        ///< of the bounding rectangle
  Eigen::Vector3f half_along_m = Eigen::Vector3f::UnitX();   ///< from the centre to the midpoint of an edge
  Eigen::Vector3f half_across_m = Eigen::Vector3f::UnitY();  ///< perpendicular to it
  bool two_sided = false;                                    ///< of an open sheet: either side may be visible
  std::vector<std::uint8_t> outline;  ///< mask of kOutline² texels over the rectangle, rows along `across`: 255 inside
};

/// Largest first, at most kMaxMirrors. Excluded: pieces smaller than a hand's breadth or 1/50 of the model, and facets
/// of curved surfaces, whose vertex normals differ from the facet's.
std::vector<FlatPiece> flat_pieces(const Model& model);

}  // namespace lumigraft::relight
