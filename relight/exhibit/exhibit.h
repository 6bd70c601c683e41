#pragma once
// The virtual objects: exhibit.toml, models, materials, motion, animations.
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/image.h"
#include "capture/session/config.h"
#include "relight/animation/rig.h"

namespace lumigraft::relight {

/// glTF 2.0 metallic-roughness. GGX alpha = roughness². specular 0 = Lambert only (KHR_materials_specular): a factor of
/// what the index of refraction reflects.
struct Material {
  Eigen::Vector3f base_color = Eigen::Vector3f(0.8f, 0.8f, 0.8f);  ///< linear
  float metallic = 0.0f;
  float roughness = 1.0f;
  float specular = 1.0f;
  /// Whether layer and body are mixed as in glTF 2.0, appendix B; else light passes the layer twice (bsdf_params.h).
  bool gltf = false;
  /// Radiance that the front of the surface emits, linear, 1: the white of the picture (VirtualObject::white_radiance).
  /// A texture multiplies it.
  Eigen::Vector3f emission = Eigen::Vector3f::Zero();
  /// Fraction of the light under the specular layer that passes the surface, coloured by the base colour, instead of
  /// being scattered back (KHR_materials_transmission).
  float transmission = 0.0f;
  float ior = 1.5f;  ///< index of refraction, at least 1 (KHR_materials_ior)
  /// Transmission through a sheet, without refraction. Else the surface bounds a volume that refracts, and of whose
  /// white light a path of the distance leaves the colour (KHR_materials_volume).
  bool thin_walled = false;
  Eigen::Vector3f attenuation_color = Eigen::Vector3f::Ones();            ///< linear
  float attenuation_distance_m = std::numeric_limits<float>::infinity();  ///< of the model
  /// The camera sees both sides of the surface in its base colour, as an emission of that, also mirrored and through
  /// glass; this lights nothing. In all other light it is as its other values say (KHR_materials_unlit).
  bool unlit = false;
  /// A dielectric coat of the index 1.5 over all of it: its intensity, from 0 to 1, and roughness
  /// (KHR_materials_clearcoat).
  float clearcoat = 0.0f, clearcoat_roughness = 0.0f;
  /// Of what the layer reflects at normal incidence, linear, at least 0 (KHR_materials_specular).
  Eigen::Vector3f specular_color = Eigen::Vector3f::Ones();
  /// Reflectance of fibres over all but the coat, linear, and their roughness (KHR_materials_sheen, sheen.h).
  Eigen::Vector3f sheen_color = Eigen::Vector3f::Zero();
  float sheen_roughness = 0.0f;
  /// From 0 to 1: how much rougher the layer is along one direction of the surface than across it; the roughness is
  /// that across it (KHR_materials_anisotropy). And the angle from the tangent to that direction, counter-clockwise.
  float anisotropy = 0.0f, anisotropy_rotation_rad = 0.0f;

  /// Reflectance of a smooth boundary at normal incidence (Fresnel), without the specular factor.
  float normal_reflectance() const { return (ior - 1) * (ior - 1) / ((ior + 1) * (ior + 1)); }
  /// The factor that has about the same normal reflectance with the index 1.5, at most 1: of opaque layers on devices.
  float layer_specular() const {
    if (ior == 1.5f && specular_color == Eigen::Vector3f::Ones()) return specular;
    return std::min(specular * normal_reflectance() / 0.04f * specular_color.mean(), 1.0f);
  }
};

inline constexpr double kMaxSpecularColor = 1e6;  ///< a reflectance of 1 is reached at 25 with the index 1.5
inline constexpr double kMaxIor = 10, kMinAttenuationDistance_m = 1e-6, kMaxAttenuationDistance_m = 1000;
inline constexpr double kMaxEmission = 100000;  ///< about the radiance of the sun over that of white paper in its light

/// Overrides for a model's own materials, which keep the way in which they are mixed. Unset values keep each part's
/// own; a base colour also replaces textures, vertex colours and the sheen, emission its texture, a specular factor the
/// specular colour, and a roughness the anisotropy. An unlit part stays so
/// unless the way in which it treats light is set.
struct MaterialOverride {
  std::optional<Eigen::Vector3f> base_color;  ///< linear
  std::optional<float> metallic, roughness, specular;
  std::optional<Eigen::Vector3f> emission;
  std::optional<float> transmission, ior;
  std::optional<bool> thin_walled;
  std::optional<Eigen::Vector3f> attenuation_color;  ///< linear
  std::optional<float> attenuation_distance_m;       ///< tag frame, whatever the model's scale
  std::optional<float> clearcoat, clearcoat_roughness;

  MaterialOverride() = default;
  MaterialOverride(const Material& all)  ///< replaces everything
      : base_color(all.base_color),
        metallic(all.metallic),
        roughness(all.roughness),
        specular(all.specular),
        emission(all.emission),
        transmission(all.transmission),
        ior(all.ior),
        thin_walled(all.thin_walled),
        attenuation_color(all.attenuation_color),
        attenuation_distance_m(all.attenuation_distance_m),
        clearcoat(all.clearcoat),
        clearcoat_roughness(all.clearcoat_roughness) {}

  bool empty() const { return *this == MaterialOverride(); }
  /// The resulting material of a part whose own is `part`.
  Material over(const Material& part) const {
    return {base_color.value_or(part.base_color),
            metallic.value_or(part.metallic),
            roughness.value_or(part.roughness),
            specular.value_or(part.specular),
            part.gltf,
            emission.value_or(part.emission),
            transmission.value_or(part.transmission),
            ior.value_or(part.ior),
            thin_walled.value_or(part.thin_walled),
            attenuation_color.value_or(part.attenuation_color),
            attenuation_distance_m.value_or(part.attenuation_distance_m),
            part.unlit && !(metallic || roughness || specular || emission || transmission || clearcoat),
            clearcoat.value_or(part.clearcoat),
            clearcoat_roughness.value_or(part.clearcoat_roughness),
            specular ? Eigen::Vector3f(1, 1, 1) : part.specular_color,
            base_color ? Eigen::Vector3f(0, 0, 0) : part.sheen_color,
            part.sheen_roughness,
            roughness ? 0 : part.anisotropy,
            part.anisotropy_rotation_rad};
  }
  bool operator==(const MaterialOverride&) const = default;
};

using TexturePicture = std::shared_ptr<const capture::Image<std::uint8_t>>;  ///< RGB, 8 bits; null: none

/// What a texture shows where its coordinates are outside 0 to 1.
enum class Wrap { repeat, clamp_to_edge, mirrored_repeat };

/// Triangles with attributes, in the model's own frame rotated so that z is up, metres. An animated one is at rest.
struct Model {
  /// A texture of a part and how it lies on the surface.
  struct TextureSlot {
    TexturePicture picture;     ///< null: none
    unsigned texcoord_set = 0;  ///< 0 or 1: texcoords or texcoords_1
    /// Takes (u, v, 1) of the set to the texture's coordinates (KHR_texture_transform).
    Eigen::Matrix<float, 2, 3> transform = Eigen::Matrix<float, 2, 3>::Identity();
    Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
  };
  struct Part {
    Material material;               ///< where a texture changes a value from 0 to 1: its mean
    TextureSlot base_color_texture;  ///< sRGB
    /// Linear: roughness in green and metallic in blue, to be multiplied with the factors.
    TextureSlot metallic_roughness_texture;
    float metallic_factor = 1, roughness_factor = 1;
    /// Linear: the normal in the tangent frame, each component from -1 to 1; x and y are to be multiplied with the
    /// scale. x is along the vertices' tangent, or the texture's u where they have none, y along their bitangent, or
    /// against the texture's v, and z along the interpolated normal.
    TextureSlot normal_texture;
    float normal_scale = 1;
    TextureSlot emissive_texture;      ///< sRGB; multiplies material.emission
    TextureSlot transmission_texture;  ///< linear: its red multiplies the factor
    float transmission_factor = 0;
    /// Linear: red of the first and green of the second multiply the factors.
    TextureSlot clearcoat_texture, clearcoat_roughness_texture;
    float clearcoat_factor = 0, clearcoat_roughness_factor = 0;
    TextureSlot clearcoat_normal_texture;  ///< as normal_texture
    float clearcoat_normal_scale = 1;
    /// Grey, linear, of specular factor and sheen roughness; sRGB of the colours.
    TextureSlot specular_texture, specular_color_texture, sheen_color_texture, sheen_roughness_texture;
    float specular_factor = 1, sheen_roughness_factor = 0;
    Eigen::Vector3f specular_color_factor = Eigen::Vector3f::Ones(), sheen_color_factor = Eigen::Vector3f::Zero();
    /// Linear: in red and green, from -1 to 1, the direction from the tangent; in blue, what multiplies the factor.
    TextureSlot anisotropy_texture;
    float anisotropy_factor = 0;
    /// The fraction of the surface that is there, from 0 to 1 (alphaMode BLEND): the factor, times the texture's red,
    /// linear.
    float opacity_factor = 1;
    TextureSlot opacity_texture;
    bool blends() const { return opacity_factor < 1 || opacity_texture.picture; }
    std::uint32_t first_index = 0, index_count = 0;
  };
  std::vector<Eigen::Vector3f> positions_m;
  std::vector<Eigen::Vector3f> normals;      ///< unit
  std::vector<Eigen::Vector2f> texcoords;    ///< zero if the model has none; v increases downwards
  std::vector<Eigen::Vector2f> texcoords_1;  ///< the second set; empty if no texture reads it
  /// As in glTF: unit tangent, then the handedness: the bitangent is w · (normal × tangent). Zero where a part has
  /// none, empty if the model has none.
  std::vector<Eigen::Vector4f> tangents;
  std::vector<Eigen::Vector3f> colors;  ///< linear vertex colours, white if the model has none
  std::vector<std::uint32_t> indices;   ///< three per triangle
  std::vector<Part> parts;
  /// A point between two vertices of the rig or such points: a + t (b - a).
  struct Mix {
    std::uint32_t a = 0, b = 0;  ///< as in `sources`, lower than its own number
    float t = 0;
  };
  std::shared_ptr<const Rig> rig;      ///< null: it has no animation, and the two below are empty
  std::vector<std::uint32_t> sources;  ///< per vertex: number of a vertex of the rig or, counted after these, of a mix
  std::vector<Mix> mixes;
  std::size_t unusable_triangles = 0;  ///< triangles of the file that were dropped
  /// The same triangles in other materials of the file (KHR_materials_variants).
  struct Variant {
    std::string name;
    std::shared_ptr<const Model> model;
  };
  std::vector<Variant> variants;       ///< of the model in its default materials
  std::vector<std::string> not_drawn;  ///< features that the file asks for, each with the first material that does
  /// Names the materials with partial coverage (Part::blends); empty: there are none.
  std::string blended;
  /// With what is at least half opaque of them in their place, for methods without partial coverage; null: none is
  /// blended.
  std::shared_ptr<const Model> cut;
};

/// glTF 2.0 (.gltf, .glb), PLY or OBJ. `up`: the file's up axis, "x", "y" or "z". Triangles of zero area or with NaN
/// are dropped and counted; throws InputError if none is left.
std::shared_ptr<const Model> load_model(const std::filesystem::path& path, char up);

struct KeyFrame {
  double time_s = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

/// Which animation of its model an object shows, and when.
struct ShownAnimation {
  std::size_t index = 0;         ///< in the model's rig
  bool loops = true;             ///< false: its last pose is held
  double begin_s = 0;            ///< frame time of its beginning; with loops of one of them
  std::optional<double> held_s;  ///< it shows this moment of the animation; nothing: it plays

  /// The moment of an animation of this length that is shown at the time of a frame.
  double moment_s(double length_s, double time_s) const;
};

struct VirtualObject {
  std::string name;
  std::shared_ptr<const Model> model;  ///< in the materials that are shown
  /// In the file's default materials, where it has variants, of which `model` is one; null: it has none.
  std::shared_ptr<const Model> default_model;
  std::optional<std::size_t> variant;                    ///< of default_model; nothing: `model` is that itself
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< tag frame
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  double scale = 1.0;
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< the model's point that is at position_m, model frame
  bool visible = true;
  bool stands = false;  ///< on the fused surface below its place (objects/standing.h)
  MaterialOverride material;
  float white_radiance = 1;      ///< of emission 1, W/sr/m²: 1 over the exposure of the colour camera
  std::vector<KeyFrame> motion;  ///< sorted by time; position linear, rotation slerp, constant outside the range
  std::optional<ShownAnimation> animation;  ///< nothing: the model has none

  Eigen::Affine3d T_tag_model(double time_s) const;
  RigPose pose(double time_s) const;  ///< at rest if the model has no animation
  /// Shows the model in a variant, or in its default materials. Returns the error that says what is allowed, if any.
  std::optional<std::string> show_variant(const std::optional<std::string>& name_of_variant);
  bool drawn(double time_s) const;  ///< visible, with a model that its animation does not shrink to nothing
};

struct Exhibit {
  std::vector<VirtualObject> objects;
};

/// The exhibit with its frame elsewhere in the tag frame: all objects and their motion are moved.
Exhibit placed_at(Exhibit exhibit, const Eigen::Isometry3d& T_tag_exhibit);

/// Reads [[object]] tables; the caller calls root.finish(). Throws InputError.
Exhibit read_exhibit(const capture::ConfigTable& root);

}  // namespace lumigraft::relight
