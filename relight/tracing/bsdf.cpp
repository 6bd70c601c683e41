#include "relight/tracing/bsdf.h"

#include <algorithm>
#include <cmath>

#include "relight/tracing/dielectric.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

}  // namespace

float interface_probability(const BsdfParams& bsdf, const Vector3f& seen_from) {
  if (!bsdf.mirrors() || bsdf.lobes == Lobes::body) return 0;
  if (bsdf.lobes != Lobes::all) return 1;
  const Rgb f = fresnel(bsdf, std::max(seen_from.z(), kMinCosine));
  const float layer = luminance(f + bsdf.transmitted * (1 - f)), body = luminance(bsdf.diffuse * (1 - f));
  if (body <= 0) return 1;
  return std::clamp(layer / (layer + body), 0.1f, 0.9f);
}

Rgb reflected(const BsdfParams& bsdf, const Vector3f& seen_from, const Vector3f& w) {
  if (w.z() <= 0) return Rgb::Zero();
  if (!bsdf.mirrors()) return bsdf.diffuse / kPi;
  const Vector3f v = lifted(seen_from), h = (v + w).normalized();
  Rgb sum = Rgb::Zero();
  if (bsdf.has_body()) sum += bsdf.diffuse * under_layer(bsdf, w.z(), v.z(), v.dot(h)) / kPi;
  if (bsdf.has_reflection()) {
    const float masking = 1 / (1 + smith_lambda(bsdf.alpha, v.z()) + smith_lambda(bsdf.alpha, w.z()));
    sum += fresnel(bsdf, v.dot(h)) * (normals_density(bsdf.alpha, h) * masking / (4 * v.z() * w.z()));
  }
  return sum;
}

Vector3f sample_direction(const BsdfParams& bsdf, const Vector3f& seen_from, Sampler& sampler) {
  const Vector3f v = lifted(seen_from);
  const bool mirror = sampler.one() < interface_probability(bsdf, v);
  if (mirror && bsdf.transmits()) return sample_interface(bsdf, v, sampler);
  const Eigen::Vector2f u = sampler.two();
  if (mirror) {
    const Vector3f h = sample_microfacet(bsdf.alpha, v, u);
    return (2 * v.dot(h) * h - v).normalized();
  }
  const float r = std::sqrt(u.x()), phi = 2 * kPi * u.y();
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(1 - u.x(), 0.0f))};
}

float direction_pdf(const BsdfParams& bsdf, const Vector3f& seen_from, const Vector3f& w) {
  const Vector3f v = lifted(seen_from);
  const float probability = interface_probability(bsdf, v);
  if (w.z() <= 0) return bsdf.transmits() && probability > 0 ? probability * interface_pdf(bsdf, v, w) : 0;
  float pdf = (1 - probability) * w.z() / kPi;
  if (probability > 0 && bsdf.transmits()) {
    pdf += probability * interface_pdf(bsdf, v, w);
  } else if (probability > 0) {
    const Vector3f h = (v + w).normalized();
    pdf += probability * normals_density(bsdf.alpha, h) / (4 * v.z() * (1 + smith_lambda(bsdf.alpha, v.z())));
  }
  return pdf;
}

}  // namespace lumigraft::relight
