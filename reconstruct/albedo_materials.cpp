#include "reconstruct/albedo_materials.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>

#include "capture/error.h"

namespace lumigraft {
namespace {

constexpr float kCell_m = 0.012f;
constexpr double kTagPaper =
    0.5 * 10.0 / 8.0;  // half the paper's edge over the black square's: one white cell around 8
constexpr float kTagThickness_m = 0.015f;

std::vector<std::array<Eigen::Vector3f, 3>> read_triangles(const RealSurface& surface) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(
      surface.mesh.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_SortByPType);
  std::vector<std::array<Eigen::Vector3f, 3>> triangles;
  for (unsigned m = 0; scene && m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices != 3) continue;
      std::array<Eigen::Vector3f, 3> triangle;
      for (std::size_t i = 0; i < 3; ++i) {
        const aiVector3D& v = mesh.mVertices[mesh.mFaces[f].mIndices[i]];
        triangle[i] = {v.x, v.y, v.z};
      }
      triangles.push_back(triangle);
    }
  }
  if (triangles.empty()) {
    throw InputError(surface.mesh.string() + ": found no triangles" +
                     (scene ? "" : std::string(" (") + importer.GetErrorString() + ")") +
                     ", allowed: a mesh of the real surface \"" + surface.name + "\"");
  }
  return triangles;
}

}  // namespace

MetalSurfaces::MetalSurfaces(const Session& session) : tag_reach_m_(kTagPaper * session.tag.size_m) {
  for (const RealSurface& surface : session.real_surfaces) {
    if (surface.metallic < 0.5f) continue;
    for (const auto& [a, b, c] : read_triangles(surface)) {
      const float longest = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
      const int steps = std::max(1, static_cast<int>(std::ceil(2 * longest / kCell_m)));
      for (int i = 0; i <= steps; ++i) {
        for (int j = 0; i + j <= steps; ++j) {
          cells_.insert(cell(a + (b - a) * (float(i) / steps) + (c - a) * (float(j) / steps)));
        }
      }
    }
  }
}

BrickKey MetalSurfaces::cell(const Eigen::Vector3f& position_m) const {
  const Eigen::Vector3f at = (position_m / kCell_m).array().round();
  return {static_cast<int>(at.x()), static_cast<int>(at.y()), static_cast<int>(at.z())};
}

bool MetalSurfaces::contains(const Eigen::Vector3f& position_m) const {
  if (cells_.empty()) return false;
  if (std::abs(position_m.x()) < tag_reach_m_ && std::abs(position_m.y()) < tag_reach_m_ &&
      std::abs(position_m.z()) < kTagThickness_m) {
    return false;
  }
  const BrickKey centre = cell(position_m);
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (cells_.count({centre[0] + dx, centre[1] + dy, centre[2] + dz})) return true;
      }
    }
  }
  return false;
}

}  // namespace lumigraft
