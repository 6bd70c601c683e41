// Loads model files: glTF by gltf/, PLY and OBJ with assimp, whose nodes are flattened.
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string_view>

#include "capture/camera/srgb.h"
#include "capture/error.h"
#include "relight/exhibit/load_gltf.h"
#include "relight/exhibit/model_builder.h"
#include "relight/exhibit/model_materials.h"

namespace lumigraft::relight {
namespace {

namespace fs = std::filesystem;

std::string extension_of(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

/// Checks of PLY files that assimp 5.2 lacks. Returns whether colours have 8 bits: these are sRGB in practice, floating
/// point colours linear. Throws InputError if the header has no end (assimp would not terminate) or an ASCII file has
/// fewer lines than its header states (assimp would repeat the last one).
bool check_ply(const fs::path& file) {
  constexpr int max_header_lines = 10000;
  const std::string where = file.string() + ": not a model that can be read: ";
  bool ascii = false, ended = false, colors_are_8_bit = false;
  std::size_t elements = 0;
  std::ifstream in(file, std::ios::binary);
  std::string line;
  for (int n = 0; n < max_header_lines && !ended && std::getline(in, line); ++n) {
    std::istringstream words(line);
    std::string keyword, second, third;
    words >> keyword >> second >> third;
    ended = keyword == "end_header";
    if (keyword == "format") ascii = second == "ascii";
    std::size_t count = 0;
    if (keyword == "element" && !(std::istringstream(third) >> count))
      throw capture::InputError(where + "found an element without its number");  // assimp would not terminate
    elements += count;
    if (keyword == "property" && (third == "red" || third == "r" || third == "diffuse_red")) {
      colors_are_8_bit = second == "uchar" || second == "uint8";
    }
  }
  if (!ended) throw capture::InputError(where + "found no end of the PLY header");
  if (!ascii) return colors_are_8_bit;

  std::size_t lines = 0;
  while (std::getline(in, line)) lines += line.find_first_not_of(" \t\r") != std::string::npos;
  if (lines < elements) {
    throw capture::InputError(where + "found " + std::to_string(lines) + " lines of data, allowed: the " +
                              std::to_string(elements) + " of its header");
  }
  return colors_are_8_bit;
}

/// The file's bytes, changed where assimp would misread them: it skips white space after the header of a binary file
/// too, and a first number may begin with such a byte, as -0.04f does. That byte, the lowest of a little-endian
/// mantissa, is increased by one.
std::string read_ply(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::size_t end = bytes.find("end_header"), data = bytes.find('\n', end) + 1;
  const std::size_t ascii = bytes.find("format ascii");
  if (end == std::string::npos || data == 0 || data >= bytes.size() || ascii < end) return bytes;
  if (std::string_view(" \t\r\n\f").find(bytes[data]) != std::string_view::npos) ++bytes[data];
  return bytes;
}

Eigen::Affine3f to_eigen(const aiMatrix4x4& m) {
  Eigen::Affine3f t;
  t.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3, m.d4;
  return t;
}

Eigen::Vector3f to_eigen(const aiVector3D& v) { return {v.x, v.y, v.z}; }

class AssimpLoader {
 public:
  AssimpLoader(const aiScene& scene, const fs::path& file, AssimpFormat format, char up, bool srgb_colors)
      : scene_(scene), up_(up_to_z(up)), srgb_colors_(srgb_colors), materials_(scene, file, format) {}

  std::shared_ptr<const Model> load() {
    if (scene_.mRootNode) add_node(*scene_.mRootNode, Eigen::Affine3f(up_));
    return builder_.build([&](std::size_t index) { return read_.at(static_cast<unsigned>(index)).part; });
  }

 private:
  void add_node(const aiNode& node, const Eigen::Affine3f& T_model_parent) {
    const Eigen::Affine3f T_model_node = T_model_parent * to_eigen(node.mTransformation);
    for (unsigned i = 0; i < node.mNumMeshes; ++i) add_mesh(*scene_.mMeshes[node.mMeshes[i]], T_model_node);
    for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(*node.mChildren[i], T_model_node);
  }

  void add_mesh(const aiMesh& mesh, const Eigen::Affine3f& T_model_node) {
    const auto [material, is_new] = read_.try_emplace(mesh.mMaterialIndex);
    if (is_new) material->second = materials_.read(mesh.mMaterialIndex, mesh.HasVertexColors(0));
    std::vector<Corner> vertices;
    vertices.reserve(mesh.mNumVertices);
    for (unsigned v = 0; v < mesh.mNumVertices; ++v)
      vertices.push_back(vertex(mesh, v, material->second.texcoord_channel));
    ModelBuilder::Mesh to = builder_.mesh(mesh.mMaterialIndex, std::move(vertices), mesh.mNumFaces, T_model_node);
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices == 3) to.add(face.mIndices[0], face.mIndices[1], face.mIndices[2]);  // else point or line
    }
    to.finish();
  }

  Corner vertex(const aiMesh& mesh, unsigned number, unsigned texcoord_channel) const {
    Corner c;
    c.position_m = to_eigen(mesh.mVertices[number]);
    if (mesh.HasNormals()) c.normal = to_eigen(mesh.mNormals[number]);
    if (mesh.HasTextureCoords(texcoord_channel)) {
      const aiVector3D& uv = mesh.mTextureCoords[texcoord_channel][number];
      c.texcoords[0] = {uv.x, uv.y};
    }
    if (mesh.HasVertexColors(0)) {
      const aiColor4D& color = mesh.mColors[0][number];
      c.color = {color.r, color.g, color.b};
      if (srgb_colors_) c.color = c.color.unaryExpr([](float v) { return capture::srgb_to_linear(v); });
    }
    return c;
  }

  const aiScene& scene_;
  Eigen::Matrix3f up_;
  bool srgb_colors_;
  ModelMaterials materials_;
  std::map<unsigned, ModelMaterial> read_;  // by index of the material
  ModelBuilder builder_;
};

/// Assimp takes a face without vertices for a polygon, and ends the program where it then finds none to divide.
void count_polygons(const aiScene& scene) {
  for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
    aiMesh& mesh = *scene.mMeshes[i];
    const auto is_polygon = [](const aiFace& face) { return face.mNumIndices > 3; };
    if (std::none_of(mesh.mFaces, mesh.mFaces + mesh.mNumFaces, is_polygon))
      mesh.mPrimitiveTypes = aiPrimitiveType_TRIANGLE;  // and what else add_mesh leaves out; 0 is not known
  }
}

std::shared_ptr<const Model> load_with_assimp(const fs::path& path, AssimpFormat format, char up) {
  const bool srgb_colors = format == AssimpFormat::ply && check_ply(path);
  Assimp::Importer importer;
  const aiScene* scene = nullptr;
  std::string reason;
  try {
    // assimp's texture coordinates have v up; glTF's convention, used here, has v down.
    constexpr unsigned steps = aiProcess_Triangulate | aiProcess_FlipUVs | aiProcess_TransformUVCoords;
    if (format == AssimpFormat::ply) {
      const std::string bytes = read_ply(path);
      scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), aiProcess_ValidateDataStructure, "ply");
    } else {
      scene = importer.ReadFile(path.string(), aiProcess_ValidateDataStructure);
    }
    if (scene) {
      count_polygons(*scene);
      scene = importer.ApplyPostProcessing(steps);
    }
    if (!scene) reason = importer.GetErrorString();
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (!scene) {
    std::replace_if(
        reason.begin(), reason.end(), [](unsigned char c) { return std::iscntrl(c); }, ' ');
    throw capture::InputError(path.string() + ": not a model that can be read: " + reason.substr(0, 200));
  }
  return AssimpLoader(*scene, path, format, up, srgb_colors).load();
}

}  // namespace

std::shared_ptr<const Model> load_model(const fs::path& path, char up) { return load_model(path, up, {}); }

std::shared_ptr<const Model> load_model(const fs::path& path, char up, const LoadProgress& progress) {
  capture::refuse_if(up != 'x' && up != 'y' && up != 'z',
                     path.string() + ": up: found \"" + std::string(1, up) + "\", allowed: x, y or z");
  const std::string extension = extension_of(path);
  const bool gltf = extension == ".gltf" || extension == ".glb", ply = extension == ".ply";
  capture::refuse_if(!gltf && !ply && extension != ".obj",
                     path.string() + ": found \"" + extension + "\", allowed: .gltf, .glb, .ply or .obj");
  capture::refuse_if(!fs::is_regular_file(path), path.string() + ": no such file");
  const std::shared_ptr<const Model> model =
      gltf ? load_gltf(path, up, progress) : load_with_assimp(path, ply ? AssimpFormat::ply : AssimpFormat::obj, up);
  capture::refuse_if(model->indices.empty(),
                     path.string() + ": found no triangles with an area, allowed: at least one");
  if (progress) progress(1);
  return model;
}

}  // namespace lumigraft::relight
