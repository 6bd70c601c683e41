#pragma once
// Bricks of albedo from surface points.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

struct PointAlbedo {
  Eigen::Vector3f albedo = Eigen::Vector3f::Zero();
  float sigma = -1;
};

/// Every voxel within AlbedoParameters::Bricks::reach steps of a surface point takes the nearest point's albedo, so
/// that interpolation between voxels works; all others are unknown.
BrickMap<AlbedoBrick> albedo_bricks(const std::vector<SurfacePoint>& points, const std::vector<PointAlbedo>& albedo);

/// Replaces bricks that differ from `before` by less than is visible by those of `before`: same pointer, same content.
void keep_unchanged(BrickMap<AlbedoBrick>& bricks, const BrickMap<AlbedoBrick>& before);

}  // namespace lumigraft::reconstruct
