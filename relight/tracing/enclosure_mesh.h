#pragma once
// What no camera saw of a room (Enclosure), as triangles with an albedo for the path-traced reference.
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/scene.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// The sides of scene.enclosure, cut into cells. The fish-eye saw radiance L towards a cell; lamps, known surfaces (of
/// `known`, with the radiance that cameras saw there) and the other sides light it with E: albedo = π L / E. Where that
/// is more than surfaces have there is no triangle: something shines there by itself, and goes on doing so. The sides
/// are moved outwards by three voxels, behind what was seen of them. They hide no lamp: the fish-eye saw it, so nothing
/// is before it, wherever a side was guessed to be. Empty where the scene has no enclosure.
std::optional<ReferenceMesh> enclosure_mesh(const reconstruct::Scene& scene, const std::vector<ReferenceMesh>& known);

/// What the fish-eye saw towards a point, but for the lamps, W/sr/m².
Eigen::Vector3f fisheye_radiance(const reconstruct::Illumination& light, const Eigen::Vector3f& p_m);

}  // namespace lumigraft::relight
