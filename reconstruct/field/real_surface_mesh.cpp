#include "reconstruct/field/real_surface_mesh.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cmath>
#include <map>

#include "capture/error.h"
#include "reconstruct/field/parameters.h"
#include "reconstruct/math/triangle.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// The nearest triangle so far. Of equally near ones the one whose normal is most parallel to the direction to the
/// voxel counts, so that the sign is right at edges.
struct Nearest {
  float distance_m = 1e9f, cosine = 0;  ///< unsigned distance; cosine between normal and direction to the voxel, signed
};

}  // namespace

std::vector<SurfaceTriangle> read_triangles(const capture::RealSurface& surface) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(
      surface.mesh.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_SortByPType);
  std::vector<SurfaceTriangle> triangles;
  for (unsigned m = 0; scene && m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices != 3) continue;
      SurfaceTriangle triangle;
      for (std::size_t i = 0; i < 3; ++i) {
        const aiVector3D& v = mesh.mVertices[mesh.mFaces[f].mIndices[i]];
        triangle[i] = {v.x, v.y, v.z};
      }
      triangles.push_back(triangle);
    }
  }
  if (triangles.empty()) {
    throw capture::InputError(surface.mesh.string() + ": found no triangles" +
                              (scene ? "" : std::string(" (") + importer.GetErrorString() + ")") +
                              ", allowed: a mesh of the real surface \"" + surface.name + "\"");
  }
  return triangles;
}

DistanceField field_of(const std::vector<SurfaceTriangle>& triangles, float voxel_m, float band_m) {
  using Bricks = std::map<BrickKey, std::array<Nearest, kBrickVoxels>>;
  Bricks found;
  Bricks::value_type* brick = nullptr;  // of the previous voxel
  for (const SurfaceTriangle& triangle : triangles) {
    const Vector3f across = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    if (!(across.norm() > 0)) continue;
    const Vector3f normal = across.normalized();
    const auto voxel_of = [&](const Vector3f& p) {
      return Eigen::Vector3i((p / voxel_m).array().floor().matrix().cast<int>());
    };
    const Eigen::Vector3i low =
        voxel_of(triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]) - Vector3f::Constant(band_m));
    const Eigen::Vector3i high =
        voxel_of(triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2]) + Vector3f::Constant(band_m));
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x) {
          const Vector3f p = voxel_m * Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
          if (std::abs(normal.dot(p - triangle[0])) > band_m) continue;
          const Vector3f a = triangle[0] - p, b = triangle[1] - p, c = triangle[2] - p;
          const Vector3f weight = nearest_to_origin(a, b, c), from = -(weight[0] * a + weight[1] * b + weight[2] * c);
          const float distance_m = from.norm();
          if (distance_m > band_m) continue;
          const float cosine = distance_m > 1e-6f ? normal.dot(from) / distance_m : 1;
          const BrickKey key = brick_of({x, y, z});
          if (!brick || key != brick->first) brick = &*found.try_emplace(key).first;
          Nearest& nearest = brick->second[static_cast<std::size_t>(index_in_brick({x, y, z}))];
          if (distance_m > nearest.distance_m + kFieldParameters.equal_distance_m) continue;
          if (distance_m > nearest.distance_m - kFieldParameters.equal_distance_m &&
              std::abs(cosine) <= std::abs(nearest.cosine))
            continue;
          nearest = {distance_m, cosine};
        }
  }
  DistanceField field;
  field.voxel_m = voxel_m;
  field.truncation_m = band_m;
  for (const auto& [key, voxels] : found) {
    auto distances = std::make_shared<FieldBrick>();
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      if (std::abs(voxels[i].cosine) < kFieldParameters.min_triangle_cosine) continue;
      distances->distance_m[i] = std::copysign(voxels[i].distance_m, voxels[i].cosine);
      distances->weight[i] = 1;
    }
    field.bricks.emplace(key, std::move(distances));
  }
  return field;
}

}  // namespace lumigraft::reconstruct
