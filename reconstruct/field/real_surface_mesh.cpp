#include "reconstruct/field/real_surface_mesh.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <map>

#include "capture/error.h"
#include "reconstruct/field/parameters.h"
#include "reconstruct/math/tag_family.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// The nearest triangle so far. Of equally near ones the one whose normal is most parallel to the direction to the
/// voxel counts, so that the sign is right at edges.
struct Nearest {
  float distance_m = 1e9f, cosine = 0;  ///< unsigned distance; cosine between normal and direction to the voxel, signed
};

constexpr float kCell_m = kFieldParameters.metal_cell_m;

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

Eigen::Vector3f nearest_to_origin(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const auto on_edge = [](float from, float to) { return from / (from + to); };
  const Eigen::Vector3f ab = b - a, ac = c - a;
  const float ab_a = -ab.dot(a), ac_a = -ac.dot(a);
  if (ab_a <= 0 && ac_a <= 0) return {1, 0, 0};
  const float ab_b = -ab.dot(b), ac_b = -ac.dot(b);
  if (ab_b >= 0 && ac_b <= ab_b) return {0, 1, 0};
  const float region_c = ab_a * ac_b - ab_b * ac_a;
  if (region_c <= 0 && ab_a >= 0 && ab_b <= 0) {
    const float t = on_edge(ab_a, -ab_b);
    return {1 - t, t, 0};
  }
  const float ab_c = -ab.dot(c), ac_c = -ac.dot(c);
  if (ac_c >= 0 && ab_c <= ac_c) return {0, 0, 1};
  const float region_b = ab_c * ac_a - ab_a * ac_c;
  if (region_b <= 0 && ac_a >= 0 && ac_c <= 0) {
    const float t = on_edge(ac_a, -ac_c);
    return {1 - t, 0, t};
  }
  const float region_a = ab_b * ac_c - ab_c * ac_b;
  const float to_c = ac_b - ab_b, to_b = ab_c - ac_c;
  if (region_a <= 0 && to_c >= 0 && to_b >= 0) {
    const float t = on_edge(to_c, to_b);
    return {0, 1 - t, t};
  }
  const float sum = region_a + region_b + region_c;
  return {region_a / sum, region_b / sum, region_c / sum};
}

MetalMask::MetalMask(const capture::Session& session) : tag_reach_m_(0.5 * print_edge_m(session.tag)) {
  for (const capture::RealSurface& surface : session.real_surfaces) {
    if (surface.metallic < kFieldParameters.min_metallic) continue;
    for (const auto& [a, b, c] : read_triangles(surface)) {
      const float longest = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
      const int steps = std::max(1, static_cast<int>(std::ceil(2 * longest / kCell_m)));
      for (int i = 0; i <= steps; ++i)
        for (int j = 0; i + j <= steps; ++j)
          cells_.insert(cell(a + (b - a) * (float(i) / steps) + (c - a) * (float(j) / steps)));
    }
  }
}

BrickKey MetalMask::cell(const Eigen::Vector3f& position_m) const {
  const Eigen::Vector3i at = (position_m / kCell_m).array().round().cast<int>();
  return {at.x(), at.y(), at.z()};
}

bool MetalMask::contains(const Eigen::Vector3f& position_m) const {
  if (cells_.empty() && mirrors_.empty()) return false;
  if (std::abs(position_m.x()) < tag_reach_m_ && std::abs(position_m.y()) < tag_reach_m_ &&
      std::abs(position_m.z()) < kFieldParameters.tag_slack_m)
    return false;
  for (const MirrorPlane& mirror : mirrors_)
    if (std::abs(mirror.normal.dot(position_m) + mirror.offset_m) < kFieldParameters.mirror_thickness_m) return true;
  const BrickKey centre = cell(position_m);
  for (int i = 0; i < 27; ++i)
    if (cells_.count({centre[0] + i % 3 - 1, centre[1] + i / 3 % 3 - 1, centre[2] + i / 9 - 1})) return true;
  return false;
}

}  // namespace lumigraft::reconstruct
