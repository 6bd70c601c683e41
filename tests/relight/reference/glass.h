#pragma once
// Transmissive objects with smooth normals, for tests.
#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::test {

inline relight::Material glass(float ior = 1.5f, float roughness = 0) {
  relight::Material material{.base_color = {1, 1, 1}, .roughness = roughness, .gltf = true};
  material.transmission = 1;
  material.ior = ior;
  return material;
}

inline relight::ReferenceMesh smooth_ball(float radius_m, const Eigen::Vector3f& centre_m,
                                          const relight::Material& material, int segments = 96) {
  relight::ReferenceMesh mesh = mesh_of(sphere(radius_m, segments), material);
  auto model = std::make_shared<relight::Model>(*mesh.model);
  for (std::size_t v = 0; v < model->positions_m.size(); ++v) model->normals[v] = model->positions_m[v].normalized();
  mesh.model = model;
  mesh.T_tag_model.translation() = centre_m;
  return mesh;
}

/// Fraction of unpolarised light that a boundary reflects, by Fresnel's amplitudes at Snell's angle.
inline double fresnel_reflectance(double angle, double ior) {
  if (angle < 1e-9) return (ior - 1) * (ior - 1) / ((ior + 1) * (ior + 1));
  const double inside = std::asin(std::sin(angle) / ior);
  const double s = std::sin(angle - inside) / std::sin(angle + inside);
  const double p = std::tan(angle - inside) / std::tan(angle + inside);
  return (s * s + p * p) / 2;
}

}  // namespace lumigraft::test
