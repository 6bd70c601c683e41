#pragma once
// Integrals over the directions that sample_direction draws.
#include <algorithm>
#include <cstdint>

#include "relight/tracing/bsdf.h"
#include "relight/tracing/sampler.h"

namespace lumigraft::test {

/// By Monte Carlo: the fraction of samples above the surface, which is the integral of direction_pdf; the albedo of
/// channel 0; and its moment, weighted by weight(w).
struct SampledLobe {
  double above = 0, albedo = 0, moment = 0;
};

template <typename Weight>
SampledLobe sampled_lobe(const relight::BsdfParams& bsdf, const Eigen::Vector3f& v, std::uint32_t seed,
                         std::uint32_t count, Weight&& weight) {
  SampledLobe lobe;
  for (std::uint32_t i = 0; i < count; ++i) {
    relight::Sampler sampler(seed, 0, i);
    const Eigen::Vector3f w = relight::sample_direction(bsdf, v, sampler);
    if (w.z() <= 0) continue;
    lobe.above += 1.0 / count;
    const double part =
        static_cast<double>(relight::reflected(bsdf, v, w)[0] * w.z() / relight::direction_pdf(bsdf, v, w)) / count;
    lobe.albedo += part;
    lobe.moment += part * static_cast<double>(weight(w));
  }
  return lobe;
}

}  // namespace lumigraft::test
