#pragma once
// Pairs of surface samples that probably have the same albedo but different irradiance.
#include <vector>

#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

struct SamplePair {
  int a, b;
  float weight = 1;
  bool adjacent = false;  ///< cells that touch, of one orientation
};

/// For each usable sample its nearest neighbours of any normal, and random ones of the same orientation up to 1 m away.
/// Two samples of known albedo are no pair. The random choice is the same for the same samples.
std::vector<SamplePair> choose_pairs(const std::vector<SurfaceSample>& samples);

}  // namespace lumigraft::reconstruct
