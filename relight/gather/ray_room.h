#pragma once
// The room without objects, prepared for ray tracing: the reconstruction as triangles, with the radiance that cameras
// measured on them, which contains all bounces of the real light and is not traced again.
#include <memory>
#include <vector>

#include "capture/session/session.h"
#include "relight/tracing/build_trace_scene.h"
#include "relight/tracing/enclosure_mesh.h"
#include "relight/tracing/light_samples.h"
#include "relight/tracing/meshes.h"
#include "relight/tracing/sky.h"

namespace lumigraft::relight {

/// A point on a real surface.
struct RealPoint {
  SurfaceHit surface;
  /// L_μ, the radiance leaving the point in all directions, W/sr/m²; NaN if it depends on the direction (known gloss).
  Rgb before = Rgb::Zero();

  bool is_even() const { return before[0] == before[0]; }
};

/// A triangle as rays of later bounces use it: one value for the whole triangle.
struct RoomFacet {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, of the side that cameras saw if fused
  Rgb albedo = Rgb::Zero(), before = Rgb::Zero();    ///< as RealPoint
  bool fused = true;                                 ///< else seen by the fish-eye only, more finely than by triangle
  bool colored = false;                              ///< radiance and albedo of fused surface are known
};

/// A surface element that represents its neighbourhood.
struct Patch {
  Eigen::Vector3f position_m, normal;
};

class RayRoom {
 public:
  /// Requires scene.field and scene.illumination; takes some tenths of a second.
  RayRoom(const reconstruct::Scene& scene, const std::vector<KnownSurface>& known, const capture::Tag& tag);
  /// The same surfaces with newer illumination; cheap. The radiance measured on them is kept.
  RayRoom(const RayRoom& room, std::shared_ptr<const reconstruct::Illumination> illumination);

  /// Whether field, albedo and enclosure are the scene's.
  bool has_surfaces_of(const reconstruct::Scene& scene) const;
  bool shares_surfaces_with(const RayRoom& other) const { return surfaces_ == other.surfaces_; }
  const std::shared_ptr<const reconstruct::Illumination>& illumination() const { return illumination_; }

  const Meshes& meshes() const { return *surfaces_->meshes; }
  const std::vector<ReferenceLamp>& lamps() const { return light_.lamps; }
  const Sky& sky() const { return *sky_; }
  float voxel_m() const { return surfaces_->field->voxel_m; }  ///< voxel size of the fused surface
  const std::shared_ptr<const reconstruct::DistanceField>& field() const { return surfaces_->field; }
  const std::vector<Patch>& patches() const { return surfaces_->patches; }

  /// Null on surfaces of known material.
  const RoomFacet* facet(const MeshHit& hit) const {
    const std::vector<RoomFacet>& of_mesh = surfaces_->facets[hit.mesh];
    return of_mesh.empty() ? nullptr : &of_mesh[hit.triangle];
  }
  /// Whether a ray along w ends on the other side of surface whose one side cameras saw, as of a thin board.
  static bool ends_behind(const RoomFacet& facet, const Eigen::Vector3f& w) {
    return facet.colored && facet.normal.dot(w) > 0;
  }
  /// L_μ leaving a point of the facet against w, W/sr/m².
  Rgb before(const RoomFacet& facet, const Eigen::Vector3f& p_m, const Eigen::Vector3f& w) const {
    if (ends_behind(facet, w)) return modelled_before(facet.albedo, p_m, -facet.normal);
    return facet.fused ? facet.before : fisheye_radiance(*illumination_, p_m).array().eval();
  }
  RealPoint point(const MeshHit& hit, const Eigen::Vector3f& w) const;

 private:
  struct MeasuredVertex {
    Eigen::Vector3f position_m, normal;
    Rgb before, albedo;
    bool colored;  ///< radiance and albedo are known
  };
  struct Surfaces {
    std::vector<ReferenceMesh> real;
    std::unique_ptr<Meshes> meshes;
    std::vector<std::vector<MeasuredVertex>> vertices;  ///< by mesh; empty for surfaces of known material
    std::vector<std::vector<RoomFacet>> facets;         ///< by mesh and triangle; likewise
    std::vector<Patch> patches;

    /// The tag's paper, which may be on a surface of known material: |x|, |y| below half of this are paper.
    float paper_m = 0;
    std::shared_ptr<const reconstruct::DistanceField> field;
    std::shared_ptr<const reconstruct::AlbedoField> albedo;
    std::shared_ptr<const reconstruct::Enclosure> enclosure;
  };

  /// Sets L_μ of vertices: measured, of the fish-eye where it was in front, else modelled.
  void color_fused_surface(const reconstruct::Scene& scene, std::vector<MeasuredVertex>& vertices) const;
  void color_enclosure(std::vector<MeasuredVertex>& vertices) const;
  RealPoint measured_point(const MeshHit& hit, const Eigen::Vector3f& w) const;
  /// Of surface without a measurement, from the modelled light. An unseen side has the albedo of the other: the
  /// radiance of that would be due to lamps which do not reach it.
  Rgb modelled_before(const Rgb& albedo, const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal) const;

  std::shared_ptr<const Surfaces> surfaces_;
  ReferenceScene light_;  ///< lamps and environment only
  std::vector<LightSampleSet> lamp_samples_;
  std::unique_ptr<Sky> sky_;
  std::shared_ptr<const reconstruct::Illumination> illumination_;
};

}  // namespace lumigraft::relight
