#pragma once
// The zero level set of a distance field as a triangle mesh, by pcl::MarchingCubes.
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

struct SurfaceMesh {
  std::vector<Eigen::Vector3f> vertices_m;  ///< tag frame
  std::vector<Eigen::Vector3f> normals;     ///< unit, towards free space; noise is filtered (normal_filter)
  std::vector<std::array<int, 3>> triangles;
};

SurfaceMesh extract_surface(const DistanceField& field);
/// Throws InputError if the file cannot be written.
void write_ply(const SurfaceMesh& mesh, const std::filesystem::path& path);

}  // namespace lumigraft::reconstruct
