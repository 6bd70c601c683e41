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

/// The triangles of PCL's marching cubes, of the cells of one brick at a time that the surface crosses: PCL's own loop
/// visits all cells of a dense grid, which would be too large for a room. Instantiated here, as PCL's library of
/// surfaces loads 18 more of VTK into every process.
class BrickCubes : public pcl::MarchingCubes<pcl::PointNormal> {
 public:
  BrickCubes() {
    lower_boundary_.setZero();
    size_voxel_.setOnes();
  }

  /// Corners of triangles, three each, in voxels relative to the brick's first voxel.
  const pcl::PointCloud<pcl::PointNormal>& run(const DistanceField& field, const BrickKey& key) {
    points_.clear();
    if (!read(field, key)) return points_;
    for (int x = 0; x < kBrickEdge; ++x)
      for (int y = 0; y < kBrickEdge; ++y)
        for (int z = 0; z < kBrickEdge; ++z) {
          // Corners in the order of PCL.
          const float* low = &distances_m_[place(x, y, z)];
          cell_ = {low[0],    low[kAcross],        low[kAcross + 1],        low[1],
                   low[kOfY], low[kAcross + kOfY], low[kAcross + kOfY + 1], low[kOfY + 1]};
          int solid = 0;
          bool known = true;
          for (const float distance_m : cell_) {
            solid += distance_m < 0;
            known = known && !std::isnan(distance_m);  // unknown space has no surface
          }
          if (known && solid > 0 && solid < 8) createSurface(cell_, {x, y, z}, points_);
        }
    return points_;
  }

 private:
  static constexpr int kLayers = kBrickEdge + 1;  ///< the brick's, and the first layer of its neighbours
  static constexpr int kOfY = kLayers, kAcross = kLayers * kLayers;

  static std::size_t place(int x, int y, int z) { return static_cast<std::size_t>(x * kAcross + y * kOfY + z); }

  void voxelizeData() override {}  // of PCL's loop

  /// Distances around the brick; false where all are on one side or unknown.
  bool read(const DistanceField& field, const BrickKey& key) {
    const FieldBrick* bricks[8];
    for (int i = 0; i < 8; ++i) bricks[i] = field.brick({key[0] + (i & 1), key[1] + (i >> 1 & 1), key[2] + (i >> 2)});
    bool free = false, solid = false;
    for (int x = 0; x < kLayers; ++x)
      for (int y = 0; y < kLayers; ++y)
        for (int z = 0; z < kLayers; ++z) {
          const FieldBrick* brick = bricks[(x >> 3) | (y >> 3) << 1 | (z >> 3) << 2];
          const int i = index_in_brick({x, y, z});
          float& distance_m = distances_m_[place(x, y, z)];
          distance_m = brick && brick->weight[i] > 0 ? brick->distance_m[i] : std::numeric_limits<float>::quiet_NaN();
          free = free || distance_m >= 0;
          solid = solid || distance_m < 0;
        }
    return free && solid;
  }

  std::array<float, kAcross * kLayers> distances_m_;
  std::vector<float> cell_;
  pcl::PointCloud<pcl::PointNormal> points_;
};

/// Identifies a vertex by its place on the grid: a grid point (all coordinates even) or an edge between two (one odd).
/// Exact, since marching cubes leaves at least two coordinates of every vertex on the grid. Merges the vertices of
/// neighbouring cells.
using GridVertex = std::array<std::int64_t, 3>;

/// Indices of the vertices of a mesh by their places. Those inside a brick need no hash table.
class VertexIndex {
 public:
  /// All that follow are in this brick.
  void enter(const BrickKey& key) {
    key_ = key;
    in_brick_.fill(kNone);
  }
  /// That of the vertex at a place, in voxels from the brick's first one; `next` if it has none yet.
  int at(const Vector3f& in_brick, int next) {
    std::array<int, 3> half;  // in half voxels
    bool at_border = false;
    for (int axis = 0; axis < 3; ++axis) {
      const auto low = static_cast<int>(in_brick[axis]);
      half[axis] = 2 * low + (in_brick[axis] != static_cast<float>(low) ? 1 : 0);
      at_border = at_border || half[axis] == 0 || half[axis] == kHalves - 1;
    }
    int& index = in_brick_[static_cast<std::size_t>((half[0] * kHalves + half[1]) * kHalves + half[2])];
    if (index != kNone) return index;
    index = next;
    if (at_border) {
      GridVertex vertex;
      for (int axis = 0; axis < 3; ++axis)
        vertex[axis] = 2 * static_cast<std::int64_t>(key_[axis]) * kBrickEdge + half[axis];
      index = at_borders_.try_emplace(vertex, next).first->second;
    }
    return index;
  }

 private:
  static constexpr int kNone = -1, kHalves = 2 * kBrickEdge + 1;
  BrickKey key_{};
  std::array<int, kHalves * kHalves * kHalves> in_brick_;
  std::unordered_map<GridVertex, int, BrickKeyHash> at_borders_;
};

}  // namespace

SurfaceMesh extract_surface(const DistanceField& field) {
  SurfaceMesh mesh;
  VertexIndex index;
  BrickCubes cubes;
  for (const BrickKey& key : sorted_keys(field.bricks)) {
    const auto& corners = cubes.run(field, key);
    if (corners.empty()) continue;
    index.enter(key);
    const Vector3f origin = first_voxel(key).cast<float>();
    for (std::size_t t = 0; t + 2 < corners.size(); t += 3) {
      std::array<int, 3> triangle{};
      for (std::size_t c = 0; c < 3; ++c) {
        const Vector3f in_brick = corners[t + c].getVector3fMap();
        const auto next = static_cast<int>(mesh.vertices_m.size());
        triangle[c] = index.at(in_brick, next);
        if (triangle[c] == next) mesh.vertices_m.emplace_back(field.voxel_m * (origin + in_brick));
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
