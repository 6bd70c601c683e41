#pragma once
// A lamp too wide to be drawn as one is several in the illumination, but it stands in one place: joined before its
// place is looked for, cut again once it is known.
#include <vector>

#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Lamps in their order, those of one region (PointLight::region) as one, where the first of them is, with the
/// least of their ids: which of them is the brightest changes with noise.
std::vector<PointLight> join_pieces(const std::vector<PointLight>& pieces);

/// The pieces where `placed` says that they are: what join_pieces made of them (`joined`, in the same order) after a
/// search. On one plane where it is flat, those that it does not reach and others at one distance. Their share of its
/// irradiance stays.
std::vector<PointLight> place_pieces(const std::vector<PointLight>& pieces, const std::vector<PointLight>& joined,
                                     const std::vector<PointLight>& placed, const Eigen::Vector3f& probe_m);

}  // namespace lumigraft::reconstruct
