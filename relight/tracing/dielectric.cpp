#include "relight/tracing/dielectric.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "relight/tracing/microfacets.h"

namespace lumigraft::relight {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

float luminance_of(const Array3f& c) { return 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2]; }

Vector3f other_side(const Vector3f& w) { return {w.x(), w.y(), -w.z()}; }

std::optional<Vector3f> refracted(const Vector3f& v, const Vector3f& h, float eta) {
  const float c = v.dot(h), cos2 = 1 - (1 - c * c) / (eta * eta);
  if (!(cos2 > 0)) return std::nullopt;
  return Vector3f((c / eta - std::sqrt(cos2)) * h - v / eta).normalized();
}

/// The microfacet that takes w below the surface to v; none if there is no such.
std::optional<Vector3f> facet_of_transmission(const BsdfParams& bsdf, const Vector3f& v, const Vector3f& w) {
  if (!bsdf.bends) return Vector3f((v + other_side(w)).normalized());
  Vector3f h = (v + bsdf.eta * w).normalized();
  if (h.z() < 0) h = -h;
  if (!(v.dot(h) > 0 && w.dot(h) < 0)) return std::nullopt;
  return h;
}

/// Probability that a microfacet reflects, by the luminances of what it reflects and transmits.
float reflection_probability(const BsdfParams& bsdf, float cos_half) {
  const Array3f f = fresnel(bsdf, cos_half);
  const float reflects = bsdf.has_reflection() ? luminance_of(f) : 0;
  const float transmits = bsdf.has_transmission() ? luminance_of(bsdf.transmitted * (1 - f)) : 0;
  return reflects + transmits > 0 ? reflects / (reflects + transmits) : 1;
}

/// Factor from the density of the microfacet to that of w below the surface (Walter et al. 2007, eq. 14 and 17).
float density_of_transmission(const BsdfParams& bsdf, const Vector3f& v, const Vector3f& w, const Vector3f& h) {
  if (!bsdf.bends) return 1 / (4 * v.dot(h));
  const float root = v.dot(h) + bsdf.eta * w.dot(h);
  return bsdf.eta * bsdf.eta * std::abs(w.dot(h)) / (root * root);
}

}  // namespace

Array3f transmitted(const BsdfParams& bsdf, const Vector3f& seen_from, const Vector3f& w) {
  if (!(w.z() < 0) || !bsdf.transmits() || !bsdf.has_transmission()) return Array3f::Zero();
  const Vector3f v = lifted(seen_from);
  const auto h = facet_of_transmission(bsdf, v, w);
  if (!h) return Array3f::Zero();
  // Masking and shadowing on opposite sides as independent (Walter et al. 2007, eq. 23).
  const float masking = 1 / (1 + smith_lambda(bsdf.alphas(), w));
  const float facets = visible_normals_density(bsdf.alphas(), v, *h) * masking;
  const float squeezed = bsdf.bends ? bsdf.eta * bsdf.eta : 1;
  const float under_all = (1 - coat_share(bsdf, seen_from)) * under_sheen(bsdf, -w.z(), v.z());
  return bsdf.transmitted * (1 - fresnel(bsdf, v.dot(*h))) * under_all *
         (facets * density_of_transmission(bsdf, v, w, *h) / (squeezed * -w.z()));
}

Vector3f sample_interface(const BsdfParams& bsdf, const Vector3f& seen_from, Sampler& sampler) {
  const Vector3f v = lifted(seen_from), h = sample_microfacet(bsdf.alphas(), v, sampler.two());
  const float cos_half = v.dot(h);
  const Vector3f mirrored = (2 * cos_half * h - v).normalized();
  if (sampler.one() < reflection_probability(bsdf, cos_half)) return mirrored.z() > 0 ? mirrored : Vector3f::Zero();
  const Vector3f w = bsdf.bends ? refracted(v, h, bsdf.eta).value_or(Vector3f::Zero()) : other_side(mirrored);
  return w.z() < 0 ? w : Vector3f::Zero();
}

float interface_pdf(const BsdfParams& bsdf, const Vector3f& seen_from, const Vector3f& w) {
  const Vector3f v = lifted(seen_from);
  if (w.z() > 0) {
    const Vector3f h = (v + w).normalized();
    const float cos_half = v.dot(h);
    return reflection_probability(bsdf, cos_half) * visible_normals_density(bsdf.alphas(), v, h) / (4 * cos_half);
  }
  if (!(w.z() < 0)) return 0;
  const auto h = facet_of_transmission(bsdf, v, w);
  if (!h) return 0;
  return (1 - reflection_probability(bsdf, v.dot(*h))) * visible_normals_density(bsdf.alphas(), v, *h) *
         density_of_transmission(bsdf, v, w, *h);
}

}  // namespace lumigraft::relight
