#pragma once
// The room without objects, ready for rays: what reconstruct found of it as triangles, and the radiance that cameras
// measured on them, which holds every bounce of the real light and is never traced again.
#include <memory>
#include <vector>

#include "capture/session/session.h"
#include "relight/tracing/build_trace_scene.h"
#include "relight/tracing/enclosure_mesh.h"
#include "relight/tracing/meshes.h"
#include "relight/tracing/sky.h"

namespace lumigraft::relight {

/// A point of a real surface.
struct RealPoint {
  SurfaceHit surface;
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
  /// Needs scene.field and scene.illumination; takes some tenths of a second.
  RayRoom(const reconstruct::Scene& scene, const std::vector<KnownSurface>& known, const capture::Tag& tag);
  /// The same surfaces under newer light, at little cost. What cameras measured on them stays.
  RayRoom(const RayRoom& room, std::shared_ptr<const reconstruct::Illumination> illumination);

  /// Whether field, albedo and enclosure are those of the scene.
  bool has_surfaces_of(const reconstruct::Scene& scene) const;
  bool shares_surfaces_with(const RayRoom& other) const { return surfaces_ == other.surfaces_; }
  const std::shared_ptr<const reconstruct::Illumination>& illumination() const { return illumination_; }

  const Meshes& meshes() const { return *surfaces_->meshes; }
  const std::vector<ReferenceLamp>& lamps() const { return light_.lamps; }
  const Sky& sky() const { return *sky_; }
  float voxel_m() const { return surfaces_->field->voxel_m; }  ///< of the fused surface
  const std::vector<Patch>& patches() const { return surfaces_->patches; }

  /// Null on known surfaces.
  const RoomFacet* facet(const MeshHit& hit) const {
    const std::vector<RoomFacet>& of_mesh = surfaces_->facets[hit.mesh];
    return of_mesh.empty() ? nullptr : &of_mesh[hit.triangle];
  }
  /// L_μ as it leaves a point of the facet, W/sr/m².
  Rgb before(const RoomFacet& facet, const Eigen::Vector3f& p_m) const {
    return facet.fused ? facet.before : fisheye_radiance(*illumination_, p_m).array().eval();
  }
  RealPoint point(const MeshHit& hit, const Eigen::Vector3f& w) const;

 private:
  struct MeasuredVertex {
    Eigen::Vector3f position_m, normal;
    Rgb before, albedo;
    bool colored;  ///< radiance and albedo are known there
  };
  struct Surfaces {
    std::vector<ReferenceMesh> real;
    std::unique_ptr<Meshes> meshes;
    std::vector<std::vector<MeasuredVertex>> vertices;  ///< by mesh; none for known surfaces
    std::vector<std::vector<RoomFacet>> facets;         ///< by mesh and triangle; likewise
    std::vector<Patch> patches;

    /// The tag's paper, which may lie on a known surface: |x|, |y| below half of this are paper.
    float paper_m = 0;
    std::shared_ptr<const reconstruct::DistanceField> field;
    std::shared_ptr<const reconstruct::AlbedoField> albedo;
    std::shared_ptr<const reconstruct::Enclosure> enclosure;
  };

  RealPoint measured_point(const MeshHit& hit, const Eigen::Vector3f& w) const;

  std::shared_ptr<const Surfaces> surfaces_;
  ReferenceScene light_;  ///< lamps and environment alone
  std::unique_ptr<Sky> sky_;
  std::shared_ptr<const reconstruct::Illumination> illumination_;
};

}  // namespace lumigraft::relight
