#pragma once
// Objects that emit light, sampled as lamps are.
#include <memory>
#include <vector>

#include "relight/tracing/emissive_surface.h"
#include "relight/tracing/lamps.h"
#include "relight/tracing/meshes.h"

namespace lumigraft::relight {

/// A point of an object, tag frame; or a patch, with means of these.
struct EmitterPoint {
  Eigen::Vector3f position_m, normal;  ///< geometric, on the side that emits; unit, of a patch shorter
  Rgb radiance;                        ///< W/sr/m², without what the coat of a point takes
  float pdf;                           ///< 1/m²
  float clearcoat = 0;                 ///< of a point
};

class Emitters {
 public:
  Emitters() = default;
  /// Per mesh, null if it does not emit.
  Emitters(const std::vector<ReferenceMesh>& meshes,
           const std::vector<std::shared_ptr<const EmissiveSurface>>& surfaces);
  explicit Emitters(const std::vector<ReferenceMesh>& meshes);

  bool empty() const { return power_ <= 0; }
  std::size_t meshes() const { return of_mesh_.size(); }
  bool emits(std::size_t mesh) const { return of_mesh_[mesh].surface != nullptr; }
  /// Of a mesh that emits, in proportion to its power; stratified if `u` is.
  EmitterPoint point(std::size_t mesh, const Eigen::Vector2f& u) const;

  /// EmissiveSurface::patches of a mesh that emits.
  std::vector<EmitterPoint> patches(std::size_t mesh) const;

  /// Towards a point of one of them, chosen by their power.
  LightSample sample(const Eigen::Vector3f& from_m, Eigen::Vector2f u) const;
  /// Density of `sample` for a ray that hits a mesh, 1/sr; 0 where it does not emit.
  float pdf(const MeshHit& hit, const Eigen::Vector3f& w) const;
  /// The same of `point`, of its mesh alone.
  float point_pdf(const MeshHit& hit, const Eigen::Vector3f& w) const;

 private:
  struct Placed {
    std::shared_ptr<const EmissiveSurface> surface;  ///< null: none
    std::shared_ptr<const Model> model;
    Eigen::Affine3f T_tag_model;
    Eigen::Matrix3f cofactor;  ///< of its linear part: turns normals, with the factor by which areas grow
    float white_radiance = 1;
    float fraction = 0, cumulative = 0;  ///< of the power of all

    EmitterPoint placed(const Eigen::Vector3f& position_m, const Eigen::Vector3f& normal, const Rgb& emission,
                        float pdf) const;
  };
  std::vector<Placed> of_mesh_;
  float power_ = 0;
};

}  // namespace lumigraft::relight
