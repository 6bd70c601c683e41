#include "relight/gather/ray_objects.h"

#include <cmath>
#include <limits>

#include "relight/gather/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

std::vector<ReferenceMesh> meshes_of(const std::vector<PlacedModel>& objects) {
  std::vector<ReferenceMesh> meshes;
  for (const PlacedModel& o : objects) {
    meshes.push_back({.model = o.places->model,
                      .T_tag_model = o.T_tag_model,
                      .material = o.material,
                      .white_radiance = o.white_radiance});
  }
  return meshes;
}

std::vector<std::shared_ptr<const ModelTree>> trees_of(const std::vector<PlacedModel>& objects) {
  std::vector<std::shared_ptr<const ModelTree>> trees;
  for (const PlacedModel& o : objects) trees.push_back(o.places->tree);
  return trees;
}

std::vector<std::shared_ptr<const EmissiveSurface>> emissive_of(const std::vector<PlacedModel>& objects) {
  std::vector<std::shared_ptr<const EmissiveSurface>> surfaces;
  for (const PlacedModel& o : objects) surfaces.push_back(o.emissive);
  return surfaces;
}

}  // namespace

std::vector<ObjectFacet> find_facets(const IrradianceProbes& places, const MaterialOverride& material) {
  const Model& model = *places.model;
  const Meshes meshes({{places.model, Eigen::Affine3f::Identity(), material, false}}, {places.tree});
  std::vector<ObjectFacet> facets;
  for (std::uint32_t t = 0; 3 * t + 2 < model.indices.size(); ++t) {
    const std::uint32_t* corner = &model.indices[3 * std::size_t{t}];
    const Vector3f& out = model.normals[corner[0]];
    const auto edge = [&](int k) { return Vector3f(model.positions_m[corner[k]] - model.positions_m[corner[0]]); };
    const float width_m = std::sqrt(edge(1).cross(edge(2)).norm() / 2);
    const SurfaceHit s = meshes.surface({width_m, 0, t, 1 / 3.0f, 1 / 3.0f}, -out, /*pixel_rad=*/1);
    const bool is_metal = !s.bsdf.transmits() && luminance(s.bsdf.f0) > luminance(s.bsdf.diffuse);
    facets.push_back({s.face, s.bsdf.diffuse, s.bsdf.mirrors(), s.unlit,
                      /*reflects_photons=*/is_metal && s.bsdf.alpha <= kGather.photon_alpha});
  }
  return facets;
}

std::vector<ObjectFacet> posed_facets(const std::vector<ObjectFacet>& at_rest, const Model& posed) {
  std::vector<ObjectFacet> facets = at_rest;
  for (std::size_t t = 0; t < facets.size(); ++t) {
    const std::uint32_t* corner = &posed.indices[3 * t];
    const Vector3f& p = posed.positions_m[corner[0]];
    facets[t].normal = (posed.positions_m[corner[1]] - p).cross(posed.positions_m[corner[2]] - p).stableNormalized();
    if (facets[t].normal.dot(posed.normals[corner[0]]) < 0) facets[t].normal = -facets[t].normal;
  }
  return facets;
}

RayObjects::RayObjects(std::vector<PlacedModel> objects)
    : objects_(std::move(objects)),
      meshes_(meshes_of(objects_), trees_of(objects_)),
      emitters_(meshes_of(objects_), emissive_of(objects_)),
      emitter_samples_(emitter_samples_of(emitters_)) {
  for (const PlacedModel& object : objects_) {
    first_.push_back(places_.size());
    normals_.push_back(object.T_tag_model.linear().inverse().transpose());
    for (const IrradianceProbes::Place& p : object.places->places) {
      places_.push_back({object.T_tag_model * p.position_m, (normals_.back() * p.normal).stableNormalized()});
    }
    const Model& model = *object.places->model;
    irradiance_.emplace_back(2 * model.positions_m.size());
    radiance_.emplace_back(object.facets->size(), std::array<Rgb, 2>{Rgb::Zero(), Rgb::Zero()});
  }
  direct_.assign(places_.size(), Rgb::Zero());
  indirect_.assign(places_.size(), Rgb::Zero());
  has_light_.assign(places_.size(), false);
}

void RayObjects::spread() {
  for (std::size_t o = 0; o < objects_.size(); ++o) {
    const IrradianceProbes& places = *objects_[o].places;
    const Model& model = *places.model;
    const std::vector<IrradianceProbes::ProbeWeight>& weights = places.interpolation->weights;
    const std::vector<std::uint32_t>& first = places.interpolation->first;
    const std::size_t vertices = model.positions_m.size(), sides = places.closed ? 1 : 2;
    for_each_index(sides * vertices, kGather.mesh_block, [&](std::size_t side) {
      Irradiance sum;
      for (std::uint32_t i = first[side]; i < first[side + 1]; ++i) {
        const std::size_t place = first_[o] + static_cast<std::size_t>(weights[i].place);
        sum.direct += weights[i].weight * direct_[place];
        sum.indirect += weights[i].weight * indirect_[place];
      }
      irradiance_[o][side] = sum;
    });
    for_each_index(radiance_[o].size(), kGather.mesh_block, [&](std::size_t t) {
      std::array<Rgb, 2>& radiance = radiance_[o][t];
      for (std::size_t side = 0; side < sides; ++side) {
        Rgb e = Rgb::Zero();
        for (std::size_t k = 3 * t; k < 3 * t + 3; ++k) {
          const Irradiance& at = irradiance_[o][model.indices[k] + side * vertices];
          e += (at.direct + at.indirect) / 3;
        }
        radiance[side] = (*objects_[o].facets)[t].albedo / kPi * e;
      }
      if (places.closed) radiance[1] = radiance[0];
    });
  }
}

void RayObjects::set_direct(std::vector<Rgb> by_place) {
  direct_ = std::move(by_place);
  spread();
}

void RayObjects::set_indirect(std::vector<Rgb> by_place) {
  indirect_ = std::move(by_place);
  has_light_.assign(places_.size(), true);
  spread();
}

void RayObjects::reuse_from(const RayObjects& others) {
  std::vector<bool> taken(others.objects_.size(), false);
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    std::size_t nearest = others.objects_.size();
    float nearest_m = std::numeric_limits<float>::infinity();
    for (std::size_t j = 0; j < others.objects_.size(); ++j) {
      if (taken[j] || others.objects_[j].at_rest != objects_[i].at_rest) continue;
      const float far_m = (objects_[i].T_tag_model.translation() - others.objects_[j].T_tag_model.translation()).norm();
      if (far_m >= nearest_m) continue;
      nearest = j;
      nearest_m = far_m;
    }
    if (nearest == others.objects_.size()) continue;
    taken[nearest] = true;
    const auto from = static_cast<std::ptrdiff_t>(others.first_[nearest]), to = static_cast<std::ptrdiff_t>(first_[i]);
    const auto count = static_cast<std::ptrdiff_t>(objects_[i].places->places.size());
    std::copy_n(others.direct_.begin() + from, count, direct_.begin() + to);
    std::copy_n(others.indirect_.begin() + from, count, indirect_.begin() + to);
    std::copy_n(others.has_light_.begin() + from, count, has_light_.begin() + to);
  }
}

void RayObjects::begin_with(const reconstruct::Sh9& environment) {
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (has_light_[i]) continue;
    indirect_[i] = reconstruct::sh_irradiance(environment, places_[i].normal).array().max(0);
    has_light_[i] = true;
  }
  spread();
}

bool RayObjects::is_inside(const Vector3f& p_m, const Vector3f& w) const {
  const auto hit = meshes_.hit(p_m, w, std::numeric_limits<float>::infinity());
  if (!hit || !objects_[hit->mesh].places->closed) return false;
  const Model& model = *objects_[hit->mesh].places->model;
  const std::uint32_t* corner = &model.indices[3 * std::size_t{hit->triangle}];
  return (normals_[hit->mesh] * model.normals[corner[0]]).dot(w) > 0;
}

RayObjects::Irradiance RayObjects::irradiance_at(const IrradianceProbes& places,
                                                 const std::vector<Irradiance>& of_vertices,
                                                 const Eigen::Matrix3f& normals, const MeshHit& hit,
                                                 const Vector3f& face) {
  const Model& model = *places.model;
  const std::uint32_t* corner = &model.indices[3 * std::size_t{hit.triangle}];
  const float weight[3] = {1 - hit.u - hit.v, hit.u, hit.v};
  Irradiance sum;
  for (int i = 0; i < 3; ++i) {
    const bool front = places.closed || (normals * model.normals[corner[i]]).dot(face) >= 0;
    const Irradiance& e = of_vertices[corner[i] + (front ? 0 : model.positions_m.size())];
    sum.direct += weight[i] * e.direct;
    sum.indirect += weight[i] * e.indirect;
  }
  return sum;
}

}  // namespace lumigraft::relight
