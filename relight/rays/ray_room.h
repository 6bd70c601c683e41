#pragma once
// The room without objects, ready for rays: what reconstruct found of it as triangles, and the radiance that cameras
// measured on them, which holds every bounce of the real light and is never traced again.
#include <memory>
#include <vector>

#include "capture/session.h"
#include "relight/reference/enclosure_mesh.h"
#include "relight/reference/meshes.h"
#include "relight/reference/scene_of.h"
#include "relight/reference/sky.h"

namespace lumigraft::rays {

/// A point of a real surface.
struct RealPoint {
  reference::Surface surface;
  /// L_μ as it leaves the point to anywhere, W/sr/m²; NaN where that depends on the direction (known gloss).
  Rgb before = Rgb::Zero();

  bool is_even() const { return before[0] == before[0]; }
};

/// A triangle as rays of later bounces meet it: they don't need to know where in it.
struct RoomFacet {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, of one of the two sides
  Rgb albedo = Rgb::Zero(), before = Rgb::Zero();    ///< as RealPoint
  bool fused = true;                                 ///< else only the fish-eye saw it, finer than triangles are
};

/// A piece of a real surface that stands for what is around it.
struct Patch {
  Eigen::Vector3f position_m, normal;
};

class RayRoom {
 public:
  /// Needs scene.field and scene.illumination.
  RayRoom(const Scene& scene, const std::vector<KnownSurface>& known, float tag_size_m);

  const reference::Meshes& meshes() const { return *meshes_; }
  const std::vector<ReferenceLamp>& lamps() const { return scene_.lamps; }
  const reference::Sky& sky() const { return *sky_; }
  const std::vector<Patch>& patches() const { return patches_; }

  /// Null on known surfaces.
  const RoomFacet* facet(const reference::MeshHit& hit) const {
    const std::vector<RoomFacet>& of_mesh = facets_[hit.mesh];
    return of_mesh.empty() ? nullptr : &of_mesh[hit.triangle];
  }
  /// L_μ as it leaves a point of the facet, W/sr/m².
  Rgb before(const RoomFacet& facet, const Eigen::Vector3f& p_m) const {
    return facet.fused ? facet.before : fisheye_radiance(*illumination_, p_m).array().eval();
  }
  RealPoint point(const reference::MeshHit& hit, const Eigen::Vector3f& w) const;

 private:
  ReferenceScene scene_;
  std::unique_ptr<reference::Meshes> meshes_;
  std::unique_ptr<reference::Sky> sky_;
  std::vector<std::vector<Rgb>> before_;        ///< by mesh and vertex; none for known surfaces
  std::vector<std::vector<bool>> colored_;      ///< likewise: radiance and albedo are known there
  std::vector<std::vector<RoomFacet>> facets_;  ///< by mesh and triangle; likewise
  std::vector<Patch> patches_;

  /// The tag's paper, which may lie on a known surface: |x|, |y| below half of this are paper.
  float paper_m_ = 0;
  std::shared_ptr<const DistanceField> field_;
  std::shared_ptr<const AlbedoField> albedo_;
  std::shared_ptr<const Illumination> illumination_;
};

}  // namespace lumigraft::rays
