#pragma once
// Converts materials of PLY and OBJ files to glTF metallic-roughness. Private to the model loader.
#include <filesystem>
#include <map>
#include <string>

#include "relight/exhibit/exhibit.h"

struct aiMaterial;
struct aiScene;

namespace lumigraft::relight {

enum class AssimpFormat { ply, obj };

struct ModelMaterial {
  Model::Part part;               ///< without triangles
  unsigned texcoord_channel = 0;  ///< texture coordinate set of its textures
};

/// Reads the materials of one file; a texture used twice is decoded once.
///
/// OBJ: Kd, taken as linear, or only the texture if there is one (the meaning of Kd with a texture varies by exporter);
/// Pm and Pr if given; else roughness from the Phong exponent, GGX α² = 2 / (Ns + 2) (Walter et al. 2007, "Microfacet
/// Models for Refraction", §5.2), and specular = Ks / 0.04. PLY: no materials; white with vertex colours or a texture,
/// else the default grey.
class ModelMaterials {
 public:
  ModelMaterials(const aiScene& scene, const std::filesystem::path& file, AssimpFormat format);
  ModelMaterial read(unsigned index, bool has_vertex_colors);

 private:
  void read_base_color_texture(const aiMaterial& source, ModelMaterial* out);
  TexturePicture decode(const std::string& reference) const;
  void read_obj(const aiMaterial& source, bool has_vertex_colors, ModelMaterial* out);

  const aiScene& scene_;
  std::filesystem::path file_;
  AssimpFormat format_;
  std::map<std::string, TexturePicture> pictures_;
};

}  // namespace lumigraft::relight
