#pragma once
// Shadows of objects, or sides of objects, that no camera saw.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/albedo/sample_solver.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// Per lamp and sample.
struct UnobservedShadows {
  std::vector<std::vector<float>> left;      ///< unoccluded fraction of the lamp, mostly 1
  std::vector<std::vector<bool>> undecided;  ///< something unobserved may occlude it, and albedo does not tell
};

/// Rays to lamps pass through unobserved space, so the unseen sides of a box let light through, and its shadow would be
/// taken for paint. A lamp (or part of it) counts as occluded at a sample if the sample is darker than its plane around
/// it, is as light as that without the lamp, and the ray to the lamp passes space that is occluded from every camera.
/// The plane's albedo is that of samples at which no lamp that matters can be occluded by anything unobserved, or which
/// were found to be in its shadow. Without such a sample, and where albedo agrees with and without the lamp, it is
/// undecided whether the lamp arrives.
///
/// `light`: irradiance of each sample; `from_lamp`: the part directly from each lamp, per lamp and sample. `held`:
/// known albedo of the last samples, which are not examined.
UnobservedShadows unobserved_shadows(const std::vector<SurfaceSample>& samples, const IrradianceModel& room,
                                     const std::vector<PointLight>& lights, const std::vector<SampleLight>& light,
                                     const std::vector<std::vector<Eigen::Vector3f>>& from_lamp, float noise_floor,
                                     const std::vector<SampleAlbedo>& held);

}  // namespace lumigraft::reconstruct
