#include "relight/tracing/bsdf.h"

#include <algorithm>
#include <cmath>

#include "relight/exhibit/sheen.h"
#include "relight/tracing/dielectric.h"
#include "relight/tracing/lamps.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

/// The shading frame's axes with z along the coat's normal.
Eigen::Matrix3f coat_axes(const BsdfParams& bsdf) {
  Vector3f x, y;
  basis(bsdf.coat_normal, x, y);
  Eigen::Matrix3f axes;
  axes << x, y, bsdf.coat_normal;
  return axes;
}

/// A GGX lobe without Fresnel: the density with which microfacets that v sees reflect it to w, 1/sr; directions as in
/// bsdf.h.
float mirrored_pdf(const Eigen::Array2f& alpha, const Vector3f& v, const Vector3f& w) {
  return normals_density(alpha, (v + w).normalized()) / (4 * v.z() * (1 + smith_lambda(alpha, v)));
}

Eigen::Array2f coat_alphas(const BsdfParams& bsdf) { return {bsdf.coat_alpha, bsdf.coat_alpha}; }

/// The coat's part of `reflected`, without its share.
float reflected_by_coat(const BsdfParams& bsdf, const Vector3f& seen_from, const Vector3f& w) {
  const Eigen::Matrix3f axes = coat_axes(bsdf);
  const Vector3f v = lifted(axes.transpose() * seen_from), to = axes.transpose() * w;
  if (to.z() <= 0) return 0;
  const Eigen::Array2f alpha = coat_alphas(bsdf);
  const float masking = 1 / (1 + smith_lambda(alpha, v) + smith_lambda(alpha, to));
  // Over the irradiance of the base, whose cosine is another.
  return normals_density(alpha, (v + to).normalized()) * masking / (4 * v.z() * w.z());
}

/// Luminance of what the layer reflects and transmits, by its Fresnel reflectance.
float layer_luminance(const BsdfParams& bsdf, const Rgb& f) { return luminance(f + bsdf.transmitted * (1 - f)); }

float sheen_luminance(const BsdfParams& bsdf, float cos_v) {
  return bsdf.has_sheen() ? luminance(bsdf.sheen) * sheen_albedo(bsdf.sheen_alpha, cos_v) : 0;
}

/// One lobe's of two, none of which is left out unless the other is all.
float probability(float own, float other) { return other > 0 ? std::clamp(own / (own + other), 0.1f, 0.9f) : 1; }

/// Probability of the coat if the interface is chosen, and of the sheen if that is and not the coat.
float coat_probability(const BsdfParams& bsdf, const Vector3f& v) {
  if (!(bsdf.coat > 0 && bsdf.has_reflection())) return 0;
  const float share = coat_share(bsdf, v);
  return probability(share, (1 - share) * (layer_luminance(bsdf, fresnel(bsdf, v.z())) + sheen_luminance(bsdf, v.z())));
}
float sheen_probability(const BsdfParams& bsdf, const Vector3f& v) {
  if (!(bsdf.has_sheen() && bsdf.has_reflection())) return 0;
  return probability(sheen_luminance(bsdf, v.z()), layer_luminance(bsdf, fresnel(bsdf, v.z())));
}

}  // namespace

float interface_probability(const BsdfParams& bsdf, const Vector3f& seen_from) {
  if (!bsdf.mirrors() || bsdf.lobes == Lobes::body) return 0;
  if (bsdf.lobes != Lobes::all) return 1;
  const Rgb f = fresnel(bsdf, std::max(seen_from.z(), kMinCosine));
  const float share = coat_share(bsdf, seen_from);
  const float layer = share + (1 - share) * (layer_luminance(bsdf, f) + sheen_luminance(bsdf, seen_from.z())),
              body = (1 - share) * luminance(bsdf.diffuse * (1 - f));
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
    const Eigen::Array2f alpha = bsdf.alphas();
    const float masking = 1 / (1 + smith_lambda(alpha, v) + smith_lambda(alpha, w));
    sum += fresnel(bsdf, v.dot(h)) * (normals_density(alpha, h) * masking / (4 * v.z() * w.z()));
  }
  if (bsdf.has_sheen()) {
    sum *= under_sheen(bsdf, w.z(), v.z());
    if (bsdf.has_reflection()) sum += bsdf.sheen * sheen_brdf(bsdf.sheen_alpha, v.z(), w.z(), h.z());
  }
  if (bsdf.coat > 0) {
    const float share = coat_share(bsdf, seen_from);
    sum *= 1 - share;
    if (bsdf.has_reflection()) sum += share * reflected_by_coat(bsdf, seen_from, w);
  }
  return sum;
}

Vector3f sample_direction(const BsdfParams& bsdf, const Vector3f& seen_from, Sampler& sampler) {
  const Vector3f v = lifted(seen_from);
  const bool mirror = sampler.one() < interface_probability(bsdf, v);
  if (mirror && bsdf.coat > 0 && sampler.one() < coat_probability(bsdf, v)) {
    const Eigen::Matrix3f axes = coat_axes(bsdf);
    const Vector3f from = lifted(axes.transpose() * seen_from),
                   h = sample_microfacet(coat_alphas(bsdf), from, sampler.two());
    return (axes * (2 * from.dot(h) * h - from)).normalized();
  }
  if (mirror && bsdf.has_sheen() && sampler.one() < sheen_probability(bsdf, v)) {
    const Eigen::Vector2f u = sampler.two();  // evenly over the hemisphere, as Estevez & Kulla 2017 do
    const float phi = 2 * kPi * u.x(), s = std::sqrt(std::max(1 - u.y() * u.y(), 0.0f));
    return {s * std::cos(phi), s * std::sin(phi), u.y()};
  }
  if (mirror && bsdf.transmits()) return sample_interface(bsdf, v, sampler);
  const Eigen::Vector2f u = sampler.two();
  if (mirror) {
    const Vector3f h = sample_microfacet(bsdf.alphas(), v, u);
    return (2 * v.dot(h) * h - v).normalized();
  }
  const float r = std::sqrt(u.x()), phi = 2 * kPi * u.y();
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(1 - u.x(), 0.0f))};
}

float direction_pdf(const BsdfParams& bsdf, const Vector3f& seen_from, const Vector3f& w) {
  const Vector3f v = lifted(seen_from);
  const float of_interface = interface_probability(bsdf, v), of_coat = coat_probability(bsdf, v);
  const float of_sheen = of_interface > 0 ? sheen_probability(bsdf, v) : 0;
  const float of_layer = of_interface * (1 - of_coat) * (1 - of_sheen);
  if (w.z() <= 0) return bsdf.transmits() && of_layer > 0 ? of_layer * interface_pdf(bsdf, v, w) : 0;
  float pdf = (1 - of_interface) * w.z() / kPi + of_interface * (1 - of_coat) * of_sheen / (2 * kPi);
  if (of_layer > 0)
    pdf += of_layer * (bsdf.transmits() ? interface_pdf(bsdf, v, w) : mirrored_pdf(bsdf.alphas(), v, w));
  if (of_interface * of_coat > 0) {
    const Eigen::Matrix3f axes = coat_axes(bsdf);
    const Vector3f from = lifted(axes.transpose() * seen_from), to = axes.transpose() * w;
    if (to.z() > 0) pdf += of_interface * of_coat * mirrored_pdf(coat_alphas(bsdf), from, to);
  }
  return pdf;
}

}  // namespace lumigraft::relight
