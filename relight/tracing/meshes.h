#pragma once
// Ray intersection with triangles by Embree, and the surface attributes at the hit.
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "relight/tracing/bsdf.h"

namespace lumigraft::relight {

struct MeshHit {
  float t_m = 0;
  std::uint32_t mesh = 0, triangle = 0;
  float u = 0, v = 0;  ///< barycentric weights of the triangle's second and third vertex
};

struct SurfaceHit {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();
  Eigen::Vector3f face = Eigen::Vector3f::UnitZ();    ///< unit, geometric, on the side of the ray's origin
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit, interpolated and by the normal map, on the same side
  BsdfParams bsdf;
  Rgb emission = Rgb::Zero();  ///< radiance that leaves the point on the side of the ray's origin, W/sr/m²
  float opacity = 1;           ///< the fraction of the surface that is there (Model::Part::blends)
  bool unlit = false;          ///< the camera sees `emission` alone, and that lights nothing (Material::unlit)
  /// Whether a transmissive material bounds a volume here, and what the medium beyond the surface absorbs, 1/m.
  bool bounds_volume = false;
  Rgb absorption_beyond = Rgb::Zero();

  /// Turns both normals towards the origin of a ray along w.
  void face_ray(const Eigen::Vector3f& w) {
    if (face.dot(w) > 0) face = -face;
    if (normal.dot(face) < 0) normal = -normal;
    if (!(normal.dot(w) < 0)) normal = face;  // a shading normal that faces away from the ray
  }
};

/// A part of a pixel that a ray represents, by its distances from the ray's unit direction.
struct RayCell {
  Eigen::Vector3f to_centre;
  Eigen::Matrix<float, 3, 2> edges;  ///< columns
};

/// A packet of rays with a common origin: cheaper than single rays.
struct RayFan {
  static constexpr int kMaxRays = 16;
  Eigen::Vector3f from_m = Eigen::Vector3f::Zero();
  std::uint32_t some = 0;  ///< bit mask of the active rays
  std::array<Eigen::Vector3f, kMaxRays> w;
  std::array<float, kMaxRays> limit_m;
};

/// Which surfaces with partial coverage a ray meets.
enum class Coverage {
  by_chance,  ///< each with the probability of its opacity, the same for the same ray (Enderton et al. 2010)
  full        ///< whatever their opacity, as if they were opaque
};

/// What surfaces leave of the light along the rays of a fan.
struct FanOcclusion {
  std::uint32_t some = 0;                           ///< bit mask of the rays that meet a surface before their limit
  std::array<float, RayFan::kMaxRays> open;         ///< fraction that passes; 1 without a surface
  std::array<float, RayFan::kMaxRays> nearest_m{};  ///< of the surfaces of those rays
};

/// Acceleration structure (BVH) of a model, in its frame.
class ModelTree {
 public:
  explicit ModelTree(std::shared_ptr<const Model> model);
  /// Of another pose of the same model, whose textures are shared.
  ModelTree(std::shared_ptr<const Model> posed, const ModelTree& at_rest);
  ~ModelTree();
  ModelTree(const ModelTree&) = delete;
  ModelTree& operator=(const ModelTree&) = delete;

  /// Takes a tree that was made of a pose to another one: its boxes are fitted anew, which is much cheaper than
  /// building it (Wald et al. 2007, "Ray Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies").
  void refit(std::shared_ptr<const Model> posed);

 private:
  friend class Meshes;
  struct State;
  std::unique_ptr<State> state_;
};

/// The trees of one model in the poses of its objects. Those that nothing uses any more are fitted to new poses.
class PosedTrees {
 public:
  std::shared_ptr<const ModelTree> at(std::shared_ptr<const Model> posed, const ModelTree& at_rest);

 private:
  std::vector<std::shared_ptr<ModelTree>> trees_;
};

class Meshes {
 public:
  /// Keeps references to what `meshes` and `seen` point to.
  Meshes(const std::vector<ReferenceMesh>& meshes, const SeenMaterials* seen);
  /// The same from existing trees, one per mesh: cheap.
  Meshes(const std::vector<ReferenceMesh>& meshes, const std::vector<std::shared_ptr<const ModelTree>>& trees);
  ~Meshes();

  bool empty() const;
  /// The nearest triangle along a unit direction, nearer than `limit_m`. All rays meet surfaces with partial coverage
  /// by chance where nothing else is said, so that the mean of many is what a fraction of the surface does.
  std::optional<MeshHit> hit(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m) const;
  /// Of all layers, the next one farther than a hit.
  std::optional<MeshHit> hit_beyond(float t_m, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w) const;
  /// Whether any of the materials has partial coverage.
  bool any_blended() const;
  /// Whether the hit mesh occludes what is behind it (ReferenceMesh::hides).
  bool hides(const MeshHit& hit) const;
  /// Whether light passes any of the mesh's materials.
  bool transmits(std::uint32_t mesh) const;
  /// Whether any of the materials is unlit.
  bool any_unlit() const;
  /// Whether an occluding mesh is nearer than `limit_m`.
  bool blocked(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m) const;
  /// Bit mask of the rays that hit a triangle before their limit; their nearest hits are in `found`.
  std::uint32_t hits(const RayFan& fan, std::array<MeshHit, RayFan::kMaxRays>& found, Coverage coverage) const;
  /// Of hiding and other meshes, without chance: the product of what their layers leave.
  FanOcclusion occlusion(const RayFan& fan) const;
  std::uint32_t blocked(const RayFan& fan) const;  ///< likewise, for occluding meshes
  /// `pixel_rad`: angle between neighbouring rays; textures are averaged over the ray's footprint.
  SurfaceHit surface(const MeshHit& hit, const Eigen::Vector3f& w, float pixel_rad = 0) const;
  /// Textures are averaged over what a part of a pixel shows of the surface's plane (Igehy 1999, "Tracing Ray
  /// Differentials").
  SurfaceHit surface(const MeshHit& hit, const Eigen::Vector3f& w, const RayCell& cell) const;
  bool textured(const MeshHit& hit) const;
  /// The same for a ray that represents a solid angle: as rough as the curved surface within it, and so rough that its
  /// lobe is not narrower (Kaplanyan & Dachsbacher 2013, "Path Space Regularization for Holistic and Robust Light
  /// Transport"). Otherwise single rays would overestimate narrow highlights, and most would miss them.
  SurfaceHit surface_within(const MeshHit& hit, const Eigen::Vector3f& w, float solid_angle_sr) const;

  /// Bounding sphere of each mesh: x, y, z, radius.
  const std::vector<Eigen::Vector4f>& spheres() const;

 private:
  struct State;
  SurfaceHit surface(const MeshHit& hit, const Eigen::Vector3f& w, float pixel_rad, const RayCell* cell) const;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
