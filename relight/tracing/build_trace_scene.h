#pragma once
// What reconstruct found of a room, and an exhibit, as a ReferenceScene.
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/scene.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// A [[real_surface]] of the session with its triangles.
struct KnownSurface {
  std::shared_ptr<const Model> model;  ///< tag frame
  Material material;
};
std::vector<KnownSurface> known_surfaces(const std::vector<capture::RealSurface>& surfaces);  ///< throws InputError

/// The room without objects. The field's zero surface, where a known surface lies replaced by that surface itself; a
/// vertex without known albedo is black, so that nothing is claimed of it. Each lamp is a sphere, or a disc where it is
/// known to be flat; one without a known distance stands so far away that its parallax across a room is below a degree.
/// What no camera saw is what scene.enclosure says, as far as it reflects (enclosure_mesh.h); light from elsewhere is
/// the remainder of the fish-eye picture. Needs scene.field and scene.illumination.
ReferenceScene reference_room_of(const reconstruct::Scene& scene, const std::vector<KnownSurface>& known);

/// Its lamps and environment alone, in place of what `room` has.
void light_room(const reconstruct::Illumination& light, ReferenceScene& room);

/// Trilinear over the voxels whose albedo is known; black where none is.
Eigen::Vector3f albedo_near(const reconstruct::AlbedoField& field, const Eigen::Vector3f& p_m);

/// The visible objects at a time.
std::vector<ReferenceMesh> reference_objects_of(const Exhibit& exhibit, double time_s);

}  // namespace lumigraft::relight
