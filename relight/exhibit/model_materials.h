#pragma once
// Converts materials of a model file to glTF metallic-roughness. Private to the model loader.
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "relight/exhibit/exhibit.h"

struct aiMaterial;
struct aiScene;

namespace lumigraft::relight {

enum class ModelFormat { gltf, ply, obj };

struct ModelMaterial {
  Model::Part part;               ///< without triangles
  unsigned texcoord_channel = 0;  ///< texture coordinate set of its textures
};

/// What a .gltf or .glb file says that assimp 5.2 does not pass on.
struct GltfExtras {
  std::vector<float> specular;  ///< KHR_materials_specular: specularFactor by assimp's number of the material; 1: none
  std::vector<std::string> not_drawn;  ///< as in Model
};
GltfExtras read_gltf_extras(const std::filesystem::path& file);

/// Reads the materials of one file; a texture used twice is decoded once.
///
/// glTF: factors as they are (linear); specularFactor from KHR_materials_specular; of textures with different sets of
/// texture coordinates, the base colour's set counts: metallic and roughness of another are replaced by their mean, a
/// normal map of another is left out. OBJ: Kd, taken as linear, or only the texture if there is
/// one (the meaning of Kd with a texture varies by exporter); Pm and Pr if given; else roughness from the Phong
/// exponent, GGX α² = 2 / (Ns + 2) (Walter et al. 2007, "Microfacet Models for Refraction", §5.2), and specular = Ks /
/// 0.04. PLY: no materials; white with vertex colours or a texture, else the default grey.
class ModelMaterials {
 public:
  ModelMaterials(const aiScene& scene, const std::filesystem::path& file, ModelFormat format);
  ModelMaterial read(unsigned index, bool has_vertex_colors);
  const std::vector<std::string>& not_drawn() const { return gltf_.not_drawn; }

 private:
  /// Of a texture's type (aiTextureType).
  struct Texture {
    TexturePicture picture;
    unsigned texcoord_channel = 0;
  };
  Texture texture(const aiMaterial& source, int type);
  void read_base_color_texture(const aiMaterial& source, int type, ModelMaterial* out);
  TexturePicture decode(const std::string& reference) const;
  void read_gltf(const aiMaterial& source, unsigned index, ModelMaterial* out);
  void read_obj(const aiMaterial& source, bool has_vertex_colors, ModelMaterial* out);

  const aiScene& scene_;
  std::filesystem::path file_;
  ModelFormat format_;
  GltfExtras gltf_;
  std::map<std::string, TexturePicture> pictures_;
};

}  // namespace lumigraft::relight
