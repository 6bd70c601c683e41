#pragma once
// The virtual objects: exhibit.toml, models, materials, motion.
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/image.h"
#include "capture/session/config.h"

namespace lumigraft::relight {

/// glTF 2.0 metallic-roughness. GGX alpha = roughness². specular 0 = Lambert alone (KHR_materials_specular).
struct Material {
  Eigen::Vector3f base_color = Eigen::Vector3f(0.8f, 0.8f, 0.8f);  ///< linear
  float metallic = 0.0f;
  float roughness = 1.0f;
  float specular = 1.0f;
};

/// What replaces a model's own materials. What is not set stays each part's own; a base colour stands in place of
/// textures and vertex colours, too.
struct MaterialOverride {
  std::optional<Eigen::Vector3f> base_color;  ///< linear
  std::optional<float> metallic, roughness, specular;

  MaterialOverride() = default;
  MaterialOverride(const Material& whole)  ///< replaces everything
      : base_color(whole.base_color), metallic(whole.metallic), roughness(whole.roughness), specular(whole.specular) {}

  bool empty() const { return *this == MaterialOverride(); }
  /// The material of a part whose own is `part`.
  Material over(const Material& part) const {
    return {base_color.value_or(part.base_color), metallic.value_or(part.metallic), roughness.value_or(part.roughness),
            specular.value_or(part.specular)};
  }
  bool operator==(const MaterialOverride&) const = default;
};

/// Triangles with attributes, in the model's own frame turned so that z is up, metres.
struct Model {
  struct Part {
    Material material;
    std::shared_ptr<const capture::Image<std::uint8_t>> base_color_texture;  ///< sRGB, RGB; null: none
    std::uint32_t first_index = 0, index_count = 0;
  };
  std::vector<Eigen::Vector3f> positions_m;
  std::vector<Eigen::Vector3f> normals;    ///< unit
  std::vector<Eigen::Vector2f> texcoords;  ///< zero where the model has none; v runs down
  std::vector<Eigen::Vector3f> colors;     ///< linear vertex colours, one where the model has none
  std::vector<std::uint32_t> indices;      ///< three per triangle
  std::vector<Part> parts;
  std::size_t unusable_triangles = 0;  ///< that the file has and this model has not
};

/// glTF 2.0 (.gltf, .glb), PLY or OBJ. `up` is the model's up axis: "x", "y" or "z". Triangles without area and with
/// NaN are dropped and counted; a model with none left throws InputError.
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
  std::vector<KeyFrame> motion;  ///< sorted by time; position linear, rotation slerp, held at both ends

  Eigen::Affine3d T_tag_model(double time_s) const;
};

struct Exhibit {
  std::vector<VirtualObject> objects;
};

/// Reads [[object]] tables; the caller calls root.finish(). Throws InputError.
Exhibit read_exhibit(const capture::ConfigTable& root);

}  // namespace lumigraft::relight
