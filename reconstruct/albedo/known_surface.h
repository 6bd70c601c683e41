#pragma once
// Surface samples of known albedo: what the light of now is estimated from.
#include <Eigen/Core>
#include <utility>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

class KnownSurface {
 public:
  KnownSurface() = default;
  /// At most AlbedoParameters::Following::max_samples of the usable samples with known albedo, evenly spread.
  KnownSurface(const Surface& surface, const std::vector<SampleAlbedo>& albedo, double print_edge_m);

  /// The samples with the radiance that they have in the field now, without those that are gone.
  std::vector<SurfaceSample> in(const DistanceField& field) const;
  std::size_t size() const { return samples_.size(); }

 private:
  struct Sample {
    SurfaceSample surface;
    std::vector<std::pair<BrickKey, int>> voxels;
  };
  std::vector<Sample> samples_;
};

}  // namespace lumigraft::reconstruct
