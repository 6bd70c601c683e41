#pragma once
// The unobserved part of a room (Enclosure), as triangles with albedo for the path-traced reference.
#include <optional>
#include <vector>

#include "reconstruct/scene.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// The sides of scene.enclosure, subdivided into cells. A cell has the albedo π L / E, where L is the radiance that the
/// fish-eye camera saw towards it and E its irradiance from lamps, known surfaces (of `known`, with the radiance that
/// cameras saw there) and the other sides. A cell whose albedo exceeds the physical range gets no triangle: it emits
/// light itself, and keeps doing so. The sides are moved outwards by three voxels, behind the surfaces observed on
/// them. They do not occlude lamps: the fish-eye camera saw the lamps, so nothing is in front of them, wherever a side
/// was estimated to be. Empty if the scene has no enclosure.
std::optional<ReferenceMesh> enclosure_mesh(const reconstruct::Scene& scene, const std::vector<ReferenceMesh>& known);

/// A Lambert part of all triangles, with the vertices' colours as albedo.
void add_part_of_vertex_colors(Model& model);

/// Radiance that the fish-eye camera saw towards a point, without lamps, W/sr/m².
Eigen::Vector3f fisheye_radiance(const reconstruct::Illumination& light, const Eigen::Vector3f& p_m);

}  // namespace lumigraft::relight
