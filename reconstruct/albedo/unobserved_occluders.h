#pragma once
// Shadows of what no camera saw.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/albedo/sample_solver.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// Rays to lamps pass through unseen space, so that light gets through the unseen sides of a box, and its shadow would
/// be taken for paint. Where a surface is darker than what lies around it in its plane, is as light as that without a
/// lamp (or without a part of it), and the way to that lamp leads through space that something hides from every camera,
/// the lamp is taken for covered.
///
/// `light` is the irradiance of each sample, of it `from_lamp` (per lamp, per sample) straight from lamps; `held`, of
/// the last samples, albedo that is known; these are not looked at.
/// @return per lamp, per sample: the share of the lamp that is left, 1 nearly everywhere
std::vector<std::vector<float>> hidden_shadows(const std::vector<SurfaceSample>& samples, const IrradianceModel& room,
                                               const std::vector<PointLight>& lights,
                                               const std::vector<SampleLight>& light,
                                               const std::vector<std::vector<Eigen::Vector3f>>& from_lamp, float dark,
                                               const std::vector<SampleAlbedo>& held);

}  // namespace lumigraft::reconstruct
