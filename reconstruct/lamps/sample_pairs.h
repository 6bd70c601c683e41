#pragma once
// Pairs of surface samples that probably have the same albedo: what light does to them differs, what they are does not.
#include <vector>

#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

struct SamplePair {
  int a, b;
};

/// For each usable sample its nearest neighbours, whatever their normals, and others of the same orientation up to half
/// a metre away. The choice is random but always the same.
std::vector<SamplePair> choose_pairs(const std::vector<SurfaceSample>& samples);

}  // namespace lumigraft::reconstruct
