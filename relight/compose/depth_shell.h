#pragma once
// This frame's depth as closed triangles, to cast shadows: a depth camera sees one side of a hand or a person.
#include <memory>
#include <opencv2/core.hpp>

#include "relight/compose/current_depth.h"
#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// Triangles, tag frame, of the depth within `part` of the image: every pixel's surface as wide as the pixel, so that
/// fingers remain. They are behind the surface by what noise and voxels explain, or it would hide lamps from itself.
///
/// Where `behind_m` is positive something moved in front of what is there, at this distance along the pixel's ray, and
/// gets a back: it is symmetric about its outline's plane, as limbs are, and ends at `behind_m`. The depth
/// of that plane is the harmonic function with the outline's depth as boundary value: flat things stay flat.
///
/// Colours of vertices are those of `color`, three channels; null: white. At most about `max_vertices` pixels are used,
/// of a regular grid. Null: no triangles.
std::shared_ptr<const Model> depth_shell(const PixelRays& rays, const Eigen::Isometry3f& T_tag_camera,
                                         const CurrentDepth& depth, const cv::Rect& part,
                                         const capture::Image<float>& behind_m, const capture::Image<float>* color,
                                         int max_vertices);

}  // namespace lumigraft::relight
