#include "relight/tracing/build_trace_scene.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/field/surface_mesh.h"
#include "relight/objects/closest_point.h"
#include "relight/tracing/bsdf.h"
#include "relight/tracing/enclosure_mesh.h"
#include "relight/tracing/parameters.h"
#include "relight/upload/lamp_emitter.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

bool lies_on(const Vector3f& p_m, const std::vector<std::unique_ptr<ObjectSurface>>& surfaces, float within_m) {
  return std::any_of(surfaces.begin(), surfaces.end(),
                     [&](const auto& surface) { return surface->nearest(p_m, within_m).has_value(); });
}

std::shared_ptr<const Model> field_model(const reconstruct::DistanceField& field,
                                         const reconstruct::AlbedoField* albedo,
                                         const std::vector<KnownSurface>& known) {
  const reconstruct::SurfaceMesh mesh = reconstruct::extract_surface(field);
  std::vector<std::unique_ptr<ObjectSurface>> surfaces;
  for (const KnownSurface& surface : known) surfaces.push_back(std::make_unique<ObjectSurface>(*surface.model));

  auto model = std::make_shared<Model>();
  model->positions_m = mesh.vertices_m;
  model->normals = mesh.normals;
  model->texcoords.assign(mesh.vertices_m.size(), Eigen::Vector2f::Zero());
  std::vector<bool> replaced;
  for (const Vector3f& p : mesh.vertices_m) {
    model->colors.push_back(albedo ? albedo_near(*albedo, p) : Vector3f::Zero());
    replaced.push_back(lies_on(p, surfaces, kTracing.same_surface_voxels * field.voxel_m));
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    if (replaced[static_cast<std::size_t>(a)] && replaced[static_cast<std::size_t>(b)] &&
        replaced[static_cast<std::size_t>(c)])
      continue;
    for (const int corner : {a, b, c}) model->indices.push_back(static_cast<std::uint32_t>(corner));
  }
  add_part_of_vertex_colors(*model);
  return model;
}

ReferenceLamp lamp_of(const reconstruct::PointLight& light, const Vector3f& probe_m) {
  const LampEmitter emitter = lamp_emitter(light, probe_m);
  ReferenceLamp lamp;
  lamp.id = light.id;
  // The rest of the light from its direction is in the residual environment; a large area light is represented by
  // several overlapping discs.
  lamp.hides = false;
  lamp.centre_m = emitter.centre_m;
  lamp.radius_m = emitter.radius_m;
  lamp.radiance = emitter.radiance().array();
  if (emitter.flat) {
    lamp.shape = emitter.half_u_m.isZero() ? ReferenceLamp::Shape::disc : ReferenceLamp::Shape::ellipse;
    lamp.half_u_m = emitter.half_u_m;
    lamp.half_v_m = emitter.half_v_m;
    lamp.normal = emitter.normal;
  }
  return lamp;
}

reconstruct::EnvironmentMap picture_of(const reconstruct::Sh9& sh) {
  reconstruct::EnvironmentMap picture{capture::Image<float>(kTracing.sky_width, kTracing.sky_height, 3), {}};
  for (int y = 0; y < kTracing.sky_height; ++y) {
    const float theta = kPi * (static_cast<float>(y) + 0.5f) / kTracing.sky_height;
    for (int x = 0; x < kTracing.sky_width; ++x) {
      const float phi = 2 * kPi * (static_cast<float>(x) + 0.5f) / kTracing.sky_width - kPi;
      const Vector3f w(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      const Vector3f radiance = reconstruct::sh_radiance(sh, w).cwiseMax(0.0f);
      for (int c = 0; c < 3; ++c) picture.radiance.at(x, y, c) = radiance[c];
    }
  }
  return picture;
}

}  // namespace

Vector3f albedo_near(const reconstruct::AlbedoField& field, const Vector3f& p_m) {
  const Vector3f at = p_m / field.voxel_m, low = at.array().floor();
  Vector3f sum = Vector3f::Zero();
  float weights = 0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3i corner(i & 1, i >> 1 & 1, i >> 2), voxel = low.cast<int>() + corner;
    const auto found = field.bricks.find(reconstruct::brick_of(voxel));
    if (found == field.bricks.end()) continue;
    const auto in_brick = static_cast<std::size_t>(reconstruct::index_in_brick(voxel));
    if (found->second->sigma[in_brick] < 0) continue;
    const Vector3f off = (corner.cast<float>() - (at - low)).cwiseAbs();
    const float weight = (1 - off.x()) * (1 - off.y()) * (1 - off.z()) + 1e-6f;
    sum += weight * found->second->albedo[in_brick];
    weights += weight;
  }
  return weights > 0 ? (sum / weights).eval() : sum;
}

std::vector<KnownSurface> known_surfaces(const std::vector<capture::RealSurface>& surfaces) {
  std::vector<KnownSurface> known;
  for (const capture::RealSurface& s : surfaces) {
    // Its material is that of the session alone.
    auto model = std::make_shared<Model>(*load_model(s.mesh, 'z'));
    for (Model::Part& part : model->parts) {
      Model::Part bare;
      bare.first_index = part.first_index;
      bare.index_count = part.index_count;
      part = bare;
    }
    known.push_back({std::move(model), {s.base_color, s.metallic, s.roughness, s.specular}});
  }
  return known;
}

ReferenceScene reference_room_of(const reconstruct::Scene& scene, const std::vector<KnownSurface>& known) {
  ReferenceScene room;
  room.real.push_back({field_model(*scene.field, scene.albedo.get(), known), Eigen::Affine3f::Identity(), {}, false});
  for (const KnownSurface& surface : known) {
    room.real.push_back({surface.model, Eigen::Affine3f::Identity(), surface.material, false});
  }
  if (auto unseen = enclosure_mesh(scene, room.real)) room.real.push_back(std::move(*unseen));
  light_room(*scene.illumination, room);
  return room;
}

void light_room(const reconstruct::Illumination& light, ReferenceScene& room) {
  room.lamps.clear();
  for (const reconstruct::PointLight& lamp : light.lights) room.lamps.push_back(lamp_of(lamp, light.probe_position_m));
  room.environment = light.environment.radiance.empty() ? picture_of(light.environment_sh) : light.environment;
}

std::vector<ReferenceMesh> reference_objects_of(const Exhibit& exhibit, double time_s) {
  std::vector<ReferenceMesh> objects;
  for (const VirtualObject& o : exhibit.objects) {
    if (!o.drawn(time_s)) continue;
    objects.push_back({.model = o.model,
                       .T_tag_model = o.T_tag_model(time_s).cast<float>(),
                       .material = o.material,
                       .white_radiance = o.white_radiance,
                       .pose = o.pose(time_s)});
  }
  return objects;
}

}  // namespace lumigraft::relight
