#pragma once
// Rays and triangles, through Embree; and what the surface is like where they meet.
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
  float u = 0, v = 0;  ///< weights of the triangle's second and third vertex
};

struct SurfaceHit {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();
  Eigen::Vector3f face = Eigen::Vector3f::UnitZ();    ///< unit normal of the triangle, on the side that is looked at
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit, smooth, on the same side
  BsdfParams look;
};

/// Rays from one point: together they cost less than each alone.
struct RayFan {
  static constexpr int kMost = 16;
  Eigen::Vector3f from_m = Eigen::Vector3f::Zero();
  std::uint32_t some = 0;  ///< by bit, which of the rays are meant
  std::array<Eigen::Vector3f, kMost> w;
  std::array<float, kMost> limit_m;
};

/// The triangles of a rigid model, sorted for rays, in the model's own frame.
class ModelTree {
 public:
  explicit ModelTree(std::shared_ptr<const Model> model);
  ~ModelTree();

 private:
  friend class Meshes;
  struct State;
  std::unique_ptr<State> state_;
};

class Meshes {
 public:
  /// Keeps references to what the meshes and `seen` point to.
  Meshes(const std::vector<ReferenceMesh>& meshes, const SeenMaterials* seen);
  /// The same, at little cost, where each mesh's model has its tree.
  Meshes(const std::vector<ReferenceMesh>& meshes, const std::vector<std::shared_ptr<const ModelTree>>& trees);
  ~Meshes();

  bool empty() const;
  /// The first triangle along a unit direction, nearer than `limit_m`.
  std::optional<MeshHit> hit(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m) const;
  /// Whether the mesh that was hit hides what is behind it (ReferenceMesh::hides).
  bool hides(const MeshHit& hit) const;
  /// Whether a mesh that hides is nearer than `limit_m`.
  bool blocked(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m) const;
  /// By bit, which rays of a fan meet a triangle before their limit; those have their first in `found`.
  std::uint32_t hits(const RayFan& fan, std::array<MeshHit, RayFan::kMost>& found) const;
  std::uint32_t blocked(const RayFan& fan) const;  ///< likewise, by meshes that hide
  SurfaceHit surface(const MeshHit& hit, const Eigen::Vector3f& w) const;

  /// A sphere around each mesh: x, y, z, radius.
  const std::vector<Eigen::Vector4f>& spheres() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
