#pragma once
// The virtual objects, ready for rays, and the irradiance of their surfaces (thesis §3.1.1.1: it does not depend on the
// camera).
#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "relight/gather/irradiance_probes.h"
#include "relight/tracing/meshes.h"

namespace lumigraft::relight {

/// Triangles as rays of later bounces meet them: they don't need to know where in them.
struct ObjectFacet {
  Eigen::Vector3f normal;  ///< of the triangle, model frame, on the side of its vertices' normals
  Rgb albedo;              ///< in its middle
  bool mirrors;
};
std::vector<ObjectFacet> find_facets(const IrradianceProbes& places, const MaterialOverride& material);

struct PlacedModel {
  std::shared_ptr<const Model> model;  ///< as it is exhibited
  std::shared_ptr<const IrradianceProbes> places;
  std::shared_ptr<const std::vector<ObjectFacet>> facets;
  Eigen::Affine3f T_tag_model = Eigen::Affine3f::Identity();
  MaterialOverride material;
};

class RayObjects {
 public:
  explicit RayObjects(std::vector<PlacedModel> objects);

  const Meshes& meshes() const { return meshes_; }
  /// Of all objects, tag frame.
  const std::vector<IrradianceProbes::Place>& places() const { return places_; }
  /// Whether a ray from there leaves a closed object.
  bool is_inside(const Eigen::Vector3f& p_m, const Eigen::Vector3f& w) const;

  struct Irradiance {
    Rgb direct = Rgb::Zero(), indirect = Rgb::Zero();
  };
  /// By place, W/m²: what lamps bring, and all else.
  void set_direct(std::vector<Rgb> by_place);
  void set_indirect(std::vector<Rgb> by_place);
  const std::vector<Rgb>& direct() const { return direct_; }
  const std::vector<Rgb>& indirect() const { return indirect_; }
  /// L_ρ that leaves a triangle of a matt object evenly to the side that w meets, W/sr/m²; null on one that mirrors.
  const Rgb* even_radiance(const MeshHit& hit, const Eigen::Vector3f& w) const {
    const ObjectFacet& facet = (*objects_[hit.mesh].facets)[hit.triangle];
    if (facet.mirrors) return nullptr;
    return &radiance_[hit.mesh][hit.triangle][(normals_[hit.mesh] * facet.normal).dot(w) < 0 ? 0 : 1];
  }
  /// Takes what others hold of the same models, perhaps elsewhere; it counts once more is set. Of several alike, the
  /// nearest.
  void reuse_from(const RayObjects& others);
  /// Whether the place's indirect light was ever set or taken.
  bool has_light(int place) const { return has_light_[static_cast<std::size_t>(place)]; }
  bool all_have_light() const { return std::find(has_light_.begin(), has_light_.end(), false) == has_light_.end(); }
  /// At a hit, on the side of `face`.
  Irradiance irradiance(const MeshHit& hit, const Eigen::Vector3f& face) const;

 private:
  void spread();

  std::vector<PlacedModel> objects_;
  Meshes meshes_;
  std::vector<IrradianceProbes::Place> places_;
  std::vector<Rgb> direct_, indirect_;    ///< by place
  std::vector<bool> has_light_;           ///< likewise
  std::vector<std::size_t> first_;        ///< of an object's places
  std::vector<Eigen::Matrix3f> normals_;  ///< from the model's frame to the tag's, by object
  /// By object and triangle, what leaves the side of its vertices' normals and the other, W/sr/m².
  std::vector<std::vector<std::array<Rgb, 2>>> radiance_;
  std::vector<std::vector<Irradiance>> irradiance_;  ///< by object; fronts of all vertices, then backs
};

}  // namespace lumigraft::relight
