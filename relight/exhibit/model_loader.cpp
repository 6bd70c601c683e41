// Loads model files with assimp. Nodes are flattened; triangles of zero area or with NaN are dropped; equal corners are
// merged to vertices; triangles are grouped by material.
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <meshoptimizer.h>

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
#include "relight/exhibit/model_corners.h"
#include "relight/exhibit/model_materials.h"

namespace lumigraft::relight {
namespace {

namespace fs = std::filesystem;

ModelFormat format_of(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".gltf" || extension == ".glb") return ModelFormat::gltf;
  if (extension == ".ply") return ModelFormat::ply;
  if (extension == ".obj") return ModelFormat::obj;
  throw capture::InputError(path.string() + ": found \"" + extension + "\", allowed: .gltf, .glb, .ply or .obj");
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
    if (keyword == "element" && std::istringstream(third) >> count) elements += count;
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

// Rotation of the model's up axis to z, right-handed.
Eigen::Matrix3f up_to_z(char up) {
  Eigen::Matrix3f rotation = Eigen::Matrix3f::Identity();
  if (up == 'x') rotation << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  if (up == 'y') rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return rotation;
}

Eigen::Affine3f to_eigen(const aiMatrix4x4& m) {
  Eigen::Affine3f t;
  t.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3, m.d4;
  return t;
}

Eigen::Vector3f to_eigen(const aiVector3D& v) { return {v.x, v.y, v.z}; }

// -0 becomes 0, so that equal values have equal bytes.
template <typename Vector>
Vector without_minus_zero(const Vector& v) {
  return v.array() + 0.0f;
}

constexpr float max_texcoord = 1e6f;  // beyond it floats are farther apart than texels

bool usable(const Corner* c) {
  for (int k = 0; k < 3; ++k) {
    if (!c[k].position_m.allFinite() || !c[k].color.allFinite()) return false;
    if (!(c[k].texcoord.cwiseAbs().maxCoeff() < max_texcoord)) return false;
  }
  const Eigen::Vector3d a = (c[1].position_m - c[0].position_m).cast<double>();
  const Eigen::Vector3d b = (c[2].position_m - c[0].position_m).cast<double>();
  const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()});
  return a.cross(b).norm() > 1e-9 * longest;
}

class Loader {
 public:
  Loader(const aiScene& scene, const fs::path& file, ModelFormat format, char up, bool srgb_colors)
      : scene_(scene), up_(up_to_z(up)), srgb_colors_(srgb_colors), materials_(scene, file, format) {}

  std::shared_ptr<const Model> load() {
    if (scene_.mRootNode) add_node(*scene_.mRootNode, Eigen::Affine3f(up_));
    auto model = std::make_shared<Model>();
    std::vector<Corner> corners;
    for (const auto& [index, batch] : batches_) {
      if (batch.corners.empty()) continue;
      Model::Part part = batch.material.part;
      part.first_index = static_cast<std::uint32_t>(corners.size());
      part.index_count = static_cast<std::uint32_t>(batch.corners.size());
      model->parts.push_back(part);
      corners.insert(corners.end(), batch.corners.begin(), batch.corners.end());
    }
    join(corners, model.get());
    model->unusable_triangles = unusable_triangles_;
    model->not_drawn = materials_.not_drawn();
    return model;
  }

 private:
  struct Batch {
    ModelMaterial material;
    std::vector<Corner> corners;
  };

  void add_node(const aiNode& node, const Eigen::Affine3f& T_model_parent) {
    const Eigen::Affine3f T_model_node = T_model_parent * to_eigen(node.mTransformation);
    for (unsigned i = 0; i < node.mNumMeshes; ++i) add_mesh(*scene_.mMeshes[node.mMeshes[i]], T_model_node);
    for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(*node.mChildren[i], T_model_node);
  }

  Batch& batch_of(const aiMesh& mesh) {
    auto found = batches_.find(mesh.mMaterialIndex);
    if (found == batches_.end()) {
      Batch batch{materials_.read(mesh.mMaterialIndex, mesh.HasVertexColors(0)), {}};
      found = batches_.emplace(mesh.mMaterialIndex, std::move(batch)).first;
    }
    return found->second;
  }

  void add_mesh(const aiMesh& mesh, const Eigen::Affine3f& T_model_node) {
    Batch& batch = batch_of(mesh);
    // Normals are transformed by the cofactor matrix, det · inverse transpose, which exists for singular transforms
    // too.
    const Eigen::Matrix3f m = T_model_node.linear();
    Eigen::Matrix3f normal_matrix;
    normal_matrix << m.col(1).cross(m.col(2)), m.col(2).cross(m.col(0)), m.col(0).cross(m.col(1));
    const bool mirrored = m.determinant() < 0;
    if (mirrored) normal_matrix = -normal_matrix;

    const std::size_t before = batch.corners.size();
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      Corner triangle[3];
      bool in_range = true;
      for (unsigned k = 0; k < 3 && in_range; ++k) {
        const unsigned vertex = face.mIndices[mirrored ? 2 - k : k];
        in_range = vertex < mesh.mNumVertices;
        if (in_range) triangle[k] = corner(mesh, vertex, batch.material.texcoord_channel, T_model_node, normal_matrix);
      }
      if (in_range && usable(triangle)) {
        batch.corners.insert(batch.corners.end(), triangle, triangle + 3);
      } else {
        ++unusable_triangles_;
      }
    }
    fill_missing_normals(std::span(batch.corners).subspan(before));
  }

  Corner corner(const aiMesh& mesh, unsigned vertex, unsigned texcoord_channel, const Eigen::Affine3f& T_model_node,
                const Eigen::Matrix3f& normal_matrix) const {
    Corner c;
    c.position_m = without_minus_zero<Eigen::Vector3f>(T_model_node * to_eigen(mesh.mVertices[vertex]));
    c.normal.setZero();
    if (mesh.HasNormals()) {
      const Eigen::Vector3f normal = normal_matrix * to_eigen(mesh.mNormals[vertex]);
      const float length = normal.stableNorm();
      if (std::isfinite(length) && length > 0) c.normal = without_minus_zero<Eigen::Vector3f>(normal / length);
    }
    c.texcoord.setZero();
    if (mesh.HasTextureCoords(texcoord_channel)) {
      const aiVector3D& uv = mesh.mTextureCoords[texcoord_channel][vertex];
      c.texcoord = without_minus_zero<Eigen::Vector2f>({uv.x, uv.y});
    }
    c.color.setOnes();
    if (mesh.HasVertexColors(0)) {
      const aiColor4D& color = mesh.mColors[0][vertex];
      c.color = {color.r, color.g, color.b};
      if (srgb_colors_) c.color = c.color.unaryExpr([](float v) { return capture::srgb_to_linear(v); });
    }
    return c;
  }

  static void join(const std::vector<Corner>& corners, Model* model) {
    model->indices.resize(corners.size());
    const std::size_t vertices = meshopt_generateVertexRemap(model->indices.data(), nullptr, corners.size(),
                                                             corners.data(), corners.size(), sizeof(Corner));
    model->positions_m.resize(vertices);
    model->normals.resize(vertices);
    model->texcoords.resize(vertices);
    model->colors.resize(vertices);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::uint32_t v = model->indices[i];
      model->positions_m[v] = corners[i].position_m;
      model->normals[v] = corners[i].normal;
      model->texcoords[v] = corners[i].texcoord;
      model->colors[v] = corners[i].color;
    }
  }

  const aiScene& scene_;
  Eigen::Matrix3f up_;
  bool srgb_colors_;
  ModelMaterials materials_;
  std::map<unsigned, Batch> batches_;  // by material
  std::size_t unusable_triangles_ = 0;
};

}  // namespace

std::shared_ptr<const Model> load_model(const fs::path& path, char up) {
  capture::refuse_if(up != 'x' && up != 'y' && up != 'z',
                     path.string() + ": up: found \"" + std::string(1, up) + "\", allowed: x, y or z");
  const ModelFormat format = format_of(path);
  if (!fs::is_regular_file(path)) throw capture::InputError(path.string() + ": no such file");
  const bool srgb_colors = format == ModelFormat::ply && check_ply(path);

  Assimp::Importer importer;
  const aiScene* scene = nullptr;
  std::string reason;
  try {
    // assimp's texture coordinates have v up; glTF's convention, used here, has v down.
    constexpr unsigned steps =
        aiProcess_ValidateDataStructure | aiProcess_Triangulate | aiProcess_FlipUVs | aiProcess_TransformUVCoords;
    if (format == ModelFormat::ply) {
      const std::string bytes = read_ply(path);
      scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), steps, "ply");
    } else {
      scene = importer.ReadFile(path.string(), steps);
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
  std::shared_ptr<const Model> model = Loader(*scene, path, format, up, srgb_colors).load();
  if (model->indices.empty())
    throw capture::InputError(path.string() + ": found no triangles with an area, allowed: at least one");
  return model;
}

}  // namespace lumigraft::relight
