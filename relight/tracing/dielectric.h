#pragma once
// The interface of transmissive materials: microfacets that reflect and transmit (Walter et al. 2007). Conventions of
// bsdf.h; w below the surface (z < 0) is transmitted light. Without refraction the transmitted lobe is the reflected
// one on the other side (KHR_materials_transmission).
#include <Eigen/Core>

#include "relight/exhibit/bsdf_params.h"
#include "relight/tracing/sampler.h"

namespace lumigraft::relight {

/// Transmitted radiance over irradiance on the other side; 0 for w above the surface. Radiance is smaller by eta² on
/// the way out of a denser medium, as in Walter et al. 2007, eq. 21.
Eigen::Array3f transmitted(const BsdfParams& bsdf, const Eigen::Vector3f& v, const Eigen::Vector3f& w);

/// Samples a direction of the interface for a given v: a microfacet, then reflection or transmission by their shares;
/// zero if the light would meet a second microfacet, which is neglected.
Eigen::Vector3f sample_interface(const BsdfParams& bsdf, const Eigen::Vector3f& v, Sampler& sampler);
float interface_pdf(const BsdfParams& bsdf, const Eigen::Vector3f& v, const Eigen::Vector3f& w);  ///< 1/sr

}  // namespace lumigraft::relight
