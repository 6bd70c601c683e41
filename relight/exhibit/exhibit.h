#pragma once
// The virtual objects: exhibit.toml, models, materials, motion.
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/image.h"
#include "capture/session/config.h"

namespace lumigraft::relight {

/// glTF 2.0 metallic-roughness. GGX alpha = roughness². specular 0 = Lambert only (KHR_materials_specular).
struct Material {
  Eigen::Vector3f base_color = Eigen::Vector3f(0.8f, 0.8f, 0.8f);  ///< linear
  float metallic = 0.0f;
  float roughness = 1.0f;
  float specular = 1.0f;
  /// Whether layer and body are mixed as in glTF 2.0, appendix B; else light passes the layer twice (bsdf_params.h).
  bool gltf = false;
  /// Radiance that the front of the surface emits, linear, 1: the white of the picture (VirtualObject::white_radiance).
  Eigen::Vector3f emission = Eigen::Vector3f::Zero();
};

inline constexpr double kMaxEmission = 100000;  ///< about the radiance of the sun over that of white paper in its light

/// Overrides for a model's own materials, which keep the way in which they are mixed. Unset values keep each part's
/// own; a base colour also replaces textures and vertex colours, and emission its texture.
struct MaterialOverride {
  std::optional<Eigen::Vector3f> base_color;  ///< linear
  std::optional<float> metallic, roughness, specular;
  std::optional<Eigen::Vector3f> emission;

  MaterialOverride() = default;
  MaterialOverride(const Material& all)  ///< replaces everything
      : base_color(all.base_color),
        metallic(all.metallic),
        roughness(all.roughness),
        specular(all.specular),
        emission(all.emission) {}

  bool empty() const { return *this == MaterialOverride(); }
  /// The resulting material of a part whose own is `part`.
  Material over(const Material& part) const {
    return {base_color.value_or(part.base_color),
            metallic.value_or(part.metallic),
            roughness.value_or(part.roughness),
            specular.value_or(part.specular),
            part.gltf,
            emission.value_or(part.emission)};
  }
  bool operator==(const MaterialOverride&) const = default;
};

using TexturePicture = std::shared_ptr<const capture::Image<std::uint8_t>>;  ///< RGB, 8 bits; null: none

/// Triangles with attributes, in the model's own frame rotated so that z is up, metres.
struct Model {
  struct Part {
    Material material;                  ///< where a texture changes metallic and roughness: their mean
    TexturePicture base_color_texture;  ///< sRGB
    /// Linear: roughness in green and metallic in blue, to be multiplied with the factors.
    TexturePicture metallic_roughness_texture;
    float metallic_factor = 1, roughness_factor = 1;
    /// Linear: the normal in the tangent frame (x along the texture's u, y against its v, z along the interpolated
    /// normal), each from -1 to 1; x and y are to be multiplied with the scale.
    TexturePicture normal_texture;
    float normal_scale = 1;
    std::uint32_t first_index = 0, index_count = 0;
  };
  std::vector<Eigen::Vector3f> positions_m;
  std::vector<Eigen::Vector3f> normals;    ///< unit
  std::vector<Eigen::Vector2f> texcoords;  ///< zero if the model has none; v increases downwards
  std::vector<Eigen::Vector3f> colors;     ///< linear vertex colours, white if the model has none
  std::vector<std::uint32_t> indices;      ///< three per triangle
  std::vector<Part> parts;
  std::size_t unusable_triangles = 0;  ///< triangles of the file that were dropped
  std::vector<std::string> not_drawn;  ///< features that the file asks for, each with the first material that does
};

/// glTF 2.0 (.gltf, .glb), PLY or OBJ. `up`: the file's up axis, "x", "y" or "z". Triangles of zero area or with NaN
/// are dropped and counted; throws InputError if none is left.
std::shared_ptr<const Model> load_model(const std::filesystem::path& path, char up);

struct KeyFrame {
  double time_s = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

struct VirtualObject {
  std::string name;
  std::shared_ptr<const Model> model;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< tag frame
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  double scale = 1.0;
  bool visible = true;
  MaterialOverride material;
  float white_radiance = 1;      ///< of emission 1, W/sr/m²: 1 over the exposure of the colour camera
  std::vector<KeyFrame> motion;  ///< sorted by time; position linear, rotation slerp, constant outside the range

  Eigen::Affine3d T_tag_model(double time_s) const;
};

struct Exhibit {
  std::vector<VirtualObject> objects;
};

/// The exhibit with its frame elsewhere in the tag frame: all objects and their motion are moved.
Exhibit placed_at(Exhibit exhibit, const Eigen::Isometry3d& T_tag_exhibit);

/// Reads [[object]] tables; the caller calls root.finish(). Throws InputError.
Exhibit read_exhibit(const capture::ConfigTable& root);

}  // namespace lumigraft::relight
