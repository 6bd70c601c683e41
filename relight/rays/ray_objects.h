#pragma once
// The virtual objects, ready for rays, and the irradiance of their surfaces (thesis §3.1.1.1: it does not depend on the
// camera).
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "relight/rays/object_places.h"
#include "relight/reference/meshes.h"

namespace lumigraft::rays {

struct PlacedModel {
  std::shared_ptr<const ObjectPlaces> places;
  Eigen::Affine3f T_tag_model = Eigen::Affine3f::Identity();
  std::optional<Material> material;  ///< replaces the model's own
};

class RayObjects {
 public:
  explicit RayObjects(std::vector<PlacedModel> objects);

  const reference::Meshes& meshes() const { return meshes_; }
  /// Of all objects, tag frame.
  const std::vector<ObjectPlaces::Place>& places() const { return places_; }
  /// Whether a ray from there leaves a closed object.
  bool is_inside(const Eigen::Vector3f& p_m, const Eigen::Vector3f& w) const;

  struct Irradiance {
    Rgb direct = Rgb::Zero(), indirect = Rgb::Zero();
  };
  /// By place, W/m²: what lamps bring, and all else.
  void set_direct(const std::vector<Rgb>& by_place);
  void set_indirect(std::vector<Rgb> by_place);
  const std::vector<Rgb>& indirect() const { return indirect_; }
  /// L_ρ that leaves a triangle of a matt object evenly to the side that w meets, W/sr/m²; null on one that mirrors.
  const Rgb* even_radiance(const reference::MeshHit& hit, const Eigen::Vector3f& w) const {
    const Facet& facet = facets_[hit.mesh][hit.triangle];
    return facet.mirrors ? nullptr : &facet.radiance[facet.normal.dot(w) < 0 ? 0 : 1];
  }
  /// At a hit, on the side of `face`.
  Irradiance irradiance(const reference::MeshHit& hit, const Eigen::Vector3f& face) const;

 private:
  struct Facet {
    Eigen::Vector3f normal;  ///< unit, on the side of its vertices' normals
    Rgb albedo;
    bool mirrors;
    std::array<Rgb, 2> radiance;  ///< of that side and of the other
  };

  template <typename Set>
  void spread(const std::vector<Rgb>& by_place, Set set);

  std::vector<PlacedModel> objects_;
  reference::Meshes meshes_;
  std::vector<ObjectPlaces::Place> places_;
  std::vector<Rgb> indirect_;                        ///< by place
  std::vector<std::size_t> first_;                   ///< of an object's places
  std::vector<Eigen::Matrix3f> normals_;             ///< from the model's frame to the tag's, by object
  std::vector<std::vector<Facet>> facets_;           ///< by object and triangle
  std::vector<std::vector<Irradiance>> irradiance_;  ///< by object; fronts of all vertices, then backs
};

}  // namespace lumigraft::rays
