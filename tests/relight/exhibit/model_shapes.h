#pragma once
// Closed-form models for tests.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::test {

using Points = std::vector<Eigen::Vector3f>;

/// Adds triangles, three points each, as one part with flat normals.
inline void add_part(relight::Model* model, const Points& corners, const relight::Material& material = {},
                     std::shared_ptr<const capture::Image<std::uint8_t>> texture = nullptr,
                     const std::vector<Eigen::Vector2f>& texcoords = {}) {
  relight::Model::Part part;
  part.material = material;
  part.base_color_texture.picture = std::move(texture);
  part.first_index = static_cast<std::uint32_t>(model->indices.size());
  part.index_count = static_cast<std::uint32_t>(corners.size());
  model->parts.push_back(part);
  for (std::size_t c = 0; c < corners.size(); ++c) {
    const std::size_t first = c - c % 3;
    model->indices.push_back(static_cast<std::uint32_t>(model->positions_m.size()));
    model->positions_m.push_back(corners[c]);
    model->normals.push_back(
        (corners[first + 1] - corners[first]).cross(corners[first + 2] - corners[first]).normalized());
    model->texcoords.push_back(c < texcoords.size() ? texcoords[c] : Eigen::Vector2f(0, 0));
    model->colors.push_back(Eigen::Vector3f::Ones());
  }
}

inline void add_quad(Points* corners, const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
                     const Eigen::Vector3f& d) {
  for (const Eigen::Vector3f& p : {a, b, c, a, c, d}) corners->push_back(p);
}

/// Outward faces; quads are counter-clockwise seen from outside.
inline Points box(const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  const auto at = [&](int n) {
    return Eigen::Vector3f(n & 1 ? high.x() : low.x(), n & 2 ? high.y() : low.y(), n & 4 ? high.z() : low.z());
  };
  Points p;
  add_quad(&p, at(0), at(2), at(3), at(1));
  add_quad(&p, at(4), at(5), at(7), at(6));
  add_quad(&p, at(0), at(1), at(5), at(4));
  add_quad(&p, at(2), at(6), at(7), at(3));
  add_quad(&p, at(0), at(4), at(6), at(2));
  add_quad(&p, at(1), at(3), at(7), at(5));
  return p;
}

/// A surface of revolution around z: profile point n of `steps` + 1 is at radius and height (x, y) of profile(n/steps).
/// Vertices at equal positions are bitwise equal.
template <typename Profile>
Points revolved(int steps, int segments, const Profile& profile) {
  Points p;
  const auto at = [&](int n, int s) {
    const Eigen::Vector2f rz = profile(static_cast<float>(n) / static_cast<float>(steps));
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(s % segments) / static_cast<float>(segments);
    return Eigen::Vector3f(rz.x() * std::cos(angle), rz.x() * std::sin(angle), rz.y());
  };
  for (int n = 0; n < steps; ++n) {
    for (int s = 0; s < segments; ++s) {
      const Eigen::Vector3f a = at(n, s), b = at(n, s + 1), c = at(n + 1, s + 1), d = at(n + 1, s);
      if (a != b) p.insert(p.end(), {a, b, c});
      if (c != d) p.insert(p.end(), {a, c, d});
    }
  }
  return p;
}

/// Profile from the south pole up to the fraction `top` of the way to the north pole (1: the whole sphere).
inline Points sphere(float radius_m, int steps, float top = 1.0f) {
  return revolved(steps, 2 * steps, [=](float t) {
    if (t == 0.0f) return Eigen::Vector2f(0, -radius_m);
    if (t * top == 1.0f) return Eigen::Vector2f(0, radius_m);
    const float polar = std::numbers::pi_v<float> * t * top;
    return Eigen::Vector2f(radius_m * std::sin(polar), -radius_m * std::cos(polar));
  });
}

inline Points inside_out(Points p) {
  for (std::size_t c = 0; c < p.size(); c += 3) std::swap(p[c + 1], p[c + 2]);
  return p;
}

inline Points moved(Points p, const Eigen::Affine3f& T) {
  for (Eigen::Vector3f& q : p) q = T * q;
  return p;
}

inline relight::Model model_of(const Points& corners) {
  relight::Model model;
  add_part(&model, corners);
  return model;
}

}  // namespace lumigraft::test
