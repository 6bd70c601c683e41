#pragma once
// Albedo of surface points into bricks.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

struct PointAlbedo {
  Eigen::Vector3f albedo = Eigen::Vector3f::Zero();
  float sigma = -1;
};

/// Every voxel within kAlbedoReach steps of a surface point takes the nearest point's albedo, so that sampling between
/// voxels works; all others are unknown.
BrickMap<AlbedoBrick> albedo_bricks(const std::vector<SurfacePoint>& points, const std::vector<PointAlbedo>& albedo);

constexpr int kAlbedoReach = 3;

/// Bricks that are as they were, but for differences that nobody would see (1 % of albedo), stay the same bricks: who
/// draws from them has nothing to do again.
void keep_unchanged(BrickMap<AlbedoBrick>& bricks, const BrickMap<AlbedoBrick>& before);

}  // namespace lumigraft::reconstruct
