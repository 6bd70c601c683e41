#pragma once
// Materials of a model file as glTF metallic-roughness. Private to the model loader.
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
  Material material;
  std::shared_ptr<const capture::Image<std::uint8_t>> base_color_texture;
  unsigned texcoord_channel = 0;  ///< which set of texture coordinates the texture is laid by
};

/// Reads the materials of one file; a picture used twice is decoded once.
///
/// glTF: factors as they are (linear); the metallic and roughness textures enter by their mean, as parts have one
/// value each; specularFactor from KHR_materials_specular.
/// OBJ: Kd, taken as linear, or the texture alone where there is one (what stands in Kd beside a map varies by
/// exporter); Pm and Pr where given; else roughness from the Phong exponent, GGX α² = 2 / (Ns + 2)  (Walter et al.
/// 2007, "Microfacet Models for Refraction", §5.2), and specular = Ks / 0.04.
/// PLY: no materials, white under vertex colours or a texture and the default grey without.
class ModelMaterials {
 public:
  ModelMaterials(const aiScene& scene, const std::filesystem::path& file, ModelFormat format);
  ModelMaterial read(unsigned index, bool has_vertex_colors);

 private:
  using Picture = std::shared_ptr<const capture::Image<std::uint8_t>>;
  Picture texture(const aiMaterial& source, int type, unsigned* texcoord_channel);
  Picture decode(const std::string& reference) const;
  float texture_mean(const aiMaterial& source, int type, int channel);
  void read_gltf(const aiMaterial& source, unsigned index, ModelMaterial* out);
  void read_obj(const aiMaterial& source, bool has_vertex_colors, ModelMaterial* out);

  const aiScene& scene_;
  std::filesystem::path file_;
  ModelFormat format_;
  std::vector<float> gltf_specular_;
  std::map<std::string, Picture> pictures_;
};

/// KHR_materials_specular: specularFactor of each material of a .gltf or .glb file (assimp 5.2 doesn't read the
/// extension). Empty where no material has it.
std::vector<float> gltf_specular_factors(const std::filesystem::path& file);

}  // namespace lumigraft::relight
