#include "reconstruct/field/surface_mesh.h"

#include <pcl/PolygonMesh.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <pcl/surface/impl/marching_cubes.hpp>
#include <unordered_map>

#include "capture/error.h"
#include "reconstruct/field/normal_filter.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// Marching cubes on one brick at a time, since PCL needs a dense grid, which would be too large for a room. PCL skips
/// the grid's first layer; the next nine are the brick and the first layer of its neighbours. Instantiated here, as
/// PCL's library of surfaces loads 18 more of VTK into every process.
class BrickCubes : public pcl::MarchingCubes<pcl::PointNormal> {
 public:
  BrickCubes() {
    setGridResolution(kLayers, kLayers, kLayers);
    // PCL computes the bounding box of its input, which voxelizeData then replaces.
    auto corners = std::make_shared<pcl::PointCloud<pcl::PointNormal>>();
    corners->resize(2);
    setInputCloud(corners);
  }

  /// Corners of triangles, three each, in voxels relative to the brick's first voxel.
  const pcl::PointCloud<pcl::PointNormal>& run(const DistanceField& field, const BrickKey& key) {
    field_ = &field;
    key_ = key;
    performReconstruction(points_, polygons_);
    return points_;
  }

 private:
  static constexpr int kLayers = kBrickEdge + 2;

  void voxelizeData() override {
    lower_boundary_ = Eigen::Array3f::Constant(-1);
    size_voxel_ = Eigen::Array3f::Constant(1);
    const FieldBrick* bricks[8];
    for (int i = 0; i < 8; ++i)
      bricks[i] = field_->brick({key_[0] + (i & 1), key_[1] + (i >> 1 & 1), key_[2] + (i >> 2)});
    for (int x = 0; x <= kBrickEdge; ++x)
      for (int y = 0; y <= kBrickEdge; ++y)
        for (int z = 0; z <= kBrickEdge; ++z) {
          const FieldBrick* brick = bricks[(x >> 3) | (y >> 3) << 1 | (z >> 3) << 2];
          const int i = index_in_brick({x, y, z});
          // PCL skips cells with a NaN: unknown space has no surface.
          grid_[((x + 1) * kLayers + y + 1) * kLayers + z + 1] =
              brick && brick->weight[i] > 0 ? brick->distance_m[i] : std::numeric_limits<float>::quiet_NaN();
        }
  }

  const DistanceField* field_ = nullptr;
  BrickKey key_{};
  pcl::PointCloud<pcl::PointNormal> points_;
  std::vector<pcl::Vertices> polygons_;
};

/// Identifies a vertex by its place on the grid: a grid point (all coordinates even) or an edge between two (one odd).
/// Exact, since marching cubes leaves at least two coordinates of every vertex on the grid. Merges the vertices of
/// neighbouring cells.
using GridVertex = std::array<std::int64_t, 3>;

GridVertex grid_vertex_of(const Vector3f& in_brick, const BrickKey& key) {
  GridVertex vertex;
  for (int axis = 0; axis < 3; ++axis) {
    const float low = std::floor(in_brick[axis]);
    vertex[axis] = 2 * (static_cast<std::int64_t>(key[axis]) * kBrickEdge + static_cast<std::int64_t>(low)) +
                   (in_brick[axis] != low ? 1 : 0);
  }
  return vertex;
}

}  // namespace

SurfaceMesh extract_surface(const DistanceField& field) {
  SurfaceMesh mesh;
  std::unordered_map<GridVertex, int, BrickKeyHash> vertex_at;
  BrickCubes cubes;
  for (const BrickKey& key : sorted_keys(field.bricks)) {
    const auto& corners = cubes.run(field, key);
    const Vector3f origin = first_voxel(key).cast<float>();
    for (std::size_t t = 0; t + 2 < corners.size(); t += 3) {
      std::array<int, 3> triangle{};
      for (std::size_t c = 0; c < 3; ++c) {
        const Vector3f in_brick = corners[t + c].getVector3fMap();
        const auto [found, is_new] =
            vertex_at.try_emplace(grid_vertex_of(in_brick, key), static_cast<int>(mesh.vertices_m.size()));
        if (is_new) mesh.vertices_m.emplace_back(field.voxel_m * (origin + in_brick));
        triangle[c] = found->second;
      }
      if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0])
        mesh.triangles.push_back(triangle);
    }
  }

  // Normals come from the field, or from the triangles where too few voxels around the vertex are known.
  std::vector<Vector3f> face_normals(mesh.vertices_m.size(), Vector3f::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3f across = (mesh.vertices_m[b] - mesh.vertices_m[a]).cross(mesh.vertices_m[c] - mesh.vertices_m[a]);
    for (const int corner : {a, b, c}) face_normals[corner] += across;
  }
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i)
    mesh.normals.push_back(field.normal(mesh.vertices_m[i]).value_or(face_normals[i].stableNormalized()));
  filter_normals(field, mesh);
  return mesh;
}

void write_ply(const SurfaceMesh& mesh, const std::filesystem::path& path) {
  std::ofstream out(path, std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices_m.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float "
         "nz\nelement face "
      << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    out.write(reinterpret_cast<const char*>(mesh.vertices_m[i].data()), 3 * sizeof(float));
    out.write(reinterpret_cast<const char*>(mesh.normals[i].data()), 3 * sizeof(float));
  }
  for (const auto& triangle : mesh.triangles) {
    out.put(3);
    out.write(reinterpret_cast<const char*>(triangle.data()), 3 * sizeof(int));
  }
  out.close();
  if (!out) throw capture::InputError(path.string() + ": cannot be written");
}

}  // namespace lumigraft::reconstruct
