#include "reconstruct/field/real_surface_mesh.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "capture/error.h"

namespace lumigraft::reconstruct {

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

}  // namespace lumigraft::reconstruct
