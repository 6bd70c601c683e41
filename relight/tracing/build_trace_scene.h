#pragma once
// Converts a reconstructed room and an exhibit to a ReferenceScene.
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/scene.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// A [[real_surface]] of the session and its triangles.
struct KnownSurface {
  std::shared_ptr<const Model> model;  ///< tag frame
  Material material;
};
std::vector<KnownSurface> known_surfaces(const std::vector<capture::RealSurface>& surfaces);  ///< throws InputError

/// The room without objects: the zero surface of the field, except where surfaces of known material replace it;
/// vertices of unknown albedo are black (no assumption is made). Each lamp is a sphere, or a disc if it is known to be
/// flat; one of unknown distance is placed so far away that parallax across a room is below a degree. Unobserved parts
/// are the reflecting part of scene.enclosure (enclosure_mesh.h); other light is the residual environment of the
/// fish-eye image. Requires scene.field and scene.illumination.
ReferenceScene reference_room_of(const reconstruct::Scene& scene, const std::vector<KnownSurface>& known);

/// Replaces only the lamps and environment of `room`.
void light_room(const reconstruct::Illumination& light, ReferenceScene& room);

/// Trilinear over the voxels of known albedo; black if there are none.
Eigen::Vector3f albedo_near(const reconstruct::AlbedoField& field, const Eigen::Vector3f& p_m);

/// The visible objects at a time.
std::vector<ReferenceMesh> reference_objects_of(const Exhibit& exhibit, double time_s);

}  // namespace lumigraft::relight
