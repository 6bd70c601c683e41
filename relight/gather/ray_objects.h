#pragma once
// The virtual objects prepared for ray tracing, and the irradiance of their surfaces (thesis §3.1.1.1: independent of
// the camera).
#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "reconstruct/math/spherical_harmonics.h"
#include "relight/gather/irradiance_probes.h"
#include "relight/tracing/emitter_samples.h"
#include "relight/tracing/meshes.h"

namespace lumigraft::relight {

/// A triangle as rays of later bounces use it: one value for the whole triangle.
struct ObjectFacet {
  Eigen::Vector3f normal;  ///< geometric normal, model frame, on the side of its vertices' normals
  Rgb albedo;              ///< mean around its centre
  bool mirrors, unlit;
  bool reflects_photons;  ///< an opaque one whose interface is narrow and reflects more than its body
};
std::vector<ObjectFacet> find_facets(const IrradianceProbes& places, const MaterialOverride& material);
/// Those of another pose of the same model.
std::vector<ObjectFacet> posed_facets(const std::vector<ObjectFacet>& at_rest, const Model& posed);

struct PlacedModel {
  std::shared_ptr<const Model> model;  ///< with the exhibit's materials
  std::shared_ptr<const IrradianceProbes> at_rest;
  std::shared_ptr<const std::vector<ObjectFacet>> facets_at_rest;
  RigPose pose;
  std::shared_ptr<const IrradianceProbes> places;  ///< in this pose, and so are those below
  std::shared_ptr<const std::vector<ObjectFacet>> facets;
  std::shared_ptr<const EmissiveSurface> emissive;  ///< null: it does not emit
  Eigen::Affine3f T_tag_model = Eigen::Affine3f::Identity();
  MaterialOverride material;
  float white_radiance = 1;  ///< as in ReferenceMesh
};

class RayObjects {
 public:
  explicit RayObjects(std::vector<PlacedModel> objects);

  const Meshes& meshes() const { return meshes_; }
  const Emitters& emitters() const { return emitters_; }
  const std::vector<EmitterSampleSet>& emitter_samples() const { return emitter_samples_; }
  /// Probes of all objects, tag frame.
  const std::vector<IrradianceProbes::Place>& places() const { return places_; }
  /// Whether a ray from this point would exit a closed object.
  bool is_inside(const Eigen::Vector3f& p_m, const Eigen::Vector3f& w) const;

  struct Irradiance {
    Rgb direct = Rgb::Zero(), indirect = Rgb::Zero();
  };
  /// Per probe, W/m²: direct light of lamps, and all other light.
  void set_direct(std::vector<Rgb> by_place);
  void set_indirect(std::vector<Rgb> by_place);
  const std::vector<Rgb>& direct() const { return direct_; }
  const std::vector<Rgb>& indirect() const { return indirect_; }
  bool is_unlit(const MeshHit& hit) const { return facet(hit).unlit; }
  bool reflects_photons(const MeshHit& hit) const { return facet(hit).reflects_photons; }
  bool any_reflects_photons(std::uint32_t mesh) const {
    return std::ranges::any_of(*objects_[mesh].facets, &ObjectFacet::reflects_photons);
  }
  /// L_ρ leaving a triangle of a matt object on the side that w hits, W/sr/m²; null on objects with a specular part.
  const Rgb* even_radiance(const MeshHit& hit, const Eigen::Vector3f& w) const {
    if (facet(hit).mirrors) return nullptr;
    return &radiance_[hit.mesh][hit.triangle][(normals_[hit.mesh] * facet(hit).normal).dot(w) < 0 ? 0 : 1];
  }
  /// Copies the indirect light of other objects with the same models, at any place and pose; takes effect with the next
  /// set. Of several with the same model, the nearest.
  void reuse_from(const RayObjects& others);
  /// Gives probes without indirect light that of an environment (spherical harmonics of its radiance, W/sr/m²) that
  /// nothing occludes, until theirs is gathered.
  void begin_with(const reconstruct::Sh9& environment);
  /// Whether the probe's indirect light was set or copied.
  bool has_light(int place) const { return has_light_[static_cast<std::size_t>(place)]; }
  bool all_have_light() const { return std::find(has_light_.begin(), has_light_.end(), false) == has_light_.end(); }
  /// At a hit, on the side of `face`.
  Irradiance irradiance(const MeshHit& hit, const Eigen::Vector3f& face) const {
    return irradiance_at(*objects_[hit.mesh].places, irradiance_[hit.mesh], normals_[hit.mesh], hit, face);
  }
  /// By object: front sides of all vertices of PlacedModel::places, then back sides.
  const std::vector<std::vector<Irradiance>>& irradiance_of_vertices() const { return irradiance_; }
  /// That of a hit, from its vertices'. `normals`: from model frame to tag frame.
  static Irradiance irradiance_at(const IrradianceProbes& places, const std::vector<Irradiance>& of_vertices,
                                  const Eigen::Matrix3f& normals, const MeshHit& hit, const Eigen::Vector3f& face);

 private:
  const ObjectFacet& facet(const MeshHit& hit) const { return (*objects_[hit.mesh].facets)[hit.triangle]; }
  void spread();

  std::vector<PlacedModel> objects_;
  Meshes meshes_;
  Emitters emitters_;
  std::vector<EmitterSampleSet> emitter_samples_;
  std::vector<IrradianceProbes::Place> places_;
  std::vector<Rgb> direct_, indirect_;    ///< per probe
  std::vector<bool> has_light_;           ///< likewise
  std::vector<std::size_t> first_;        ///< index of each object's first probe
  std::vector<Eigen::Matrix3f> normals_;  ///< from model frame to tag frame, per object
  /// Per object and triangle, radiance leaving the side of its vertices' normals and the other, W/sr/m².
  std::vector<std::vector<std::array<Rgb, 2>>> radiance_;
  std::vector<std::vector<Irradiance>> irradiance_;  ///< irradiance_of_vertices()
};

}  // namespace lumigraft::relight
