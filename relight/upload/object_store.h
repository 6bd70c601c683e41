#pragma once
// GPU data of the virtual models: triangles, textures, distance fields. Uploaded once per model.
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "relight/exhibit/exhibit.h"
#include "relight/gpu/device.h"
#include "relight/objects/placement.h"
#include "relight/upload/upload_model.h"

namespace lumigraft::relight {

struct StoredModel {
  /// Of a pose of an animated model it has vertices, samples and grids of its own, the rest is shared.
  struct Mesh {
    /// Position, normal, both texture coordinates, colour, tangent and handedness (zero: none): 17 floats.
    std::unique_ptr<gpu::Buffer> vertices;
    int vertex_count = 0;
    bool closed = false;  ///< of `simple`: every edge joins two triangles that traverse it in opposite directions
    struct Part {
      std::shared_ptr<gpu::Buffer> indices;  ///< of all poses
      std::uint32_t index_count = 0;
      Material material;
      float metallic_factor = 1, roughness_factor = 1, normal_scale = 1;  ///< of the textures, and so are these
      float transmission_factor = 0, clearcoat_factor = 0, clearcoat_roughness_factor = 0;
      struct PlacedTexture {
        const gpu::Texture* texture = nullptr;  ///< null: none, or not uploaded yet
        Model::TextureSlot slot;
      };
      PerTextureUse<PlacedTexture> textures;

      const PlacedTexture& texture(TextureUse use) const { return textures[static_cast<std::size_t>(use)]; }
      /// Where it is one of this part's: `key` is as in UploadModel::textures.
      void set_texture(const std::pair<const capture::Image<std::uint8_t>*, Texels>& key, const gpu::Texture& texture);
    };
    std::vector<Part> parts;
  };
  std::shared_ptr<const Model> model;           ///< at rest
  RigPose pose;                                 ///< in which it is stored
  std::shared_ptr<const StoredModel> at_rest;   ///< owns the textures of a pose; null: it is at rest itself
  std::shared_ptr<const UploadModel> prepared;  ///< of which poses are made; null if the model has no animation
  std::shared_ptr<const Model> shown;           ///< in the pose
  Mesh full, simple;                            ///< simple: large meshes simplified, large triangles subdivided
  std::string why_simple;  ///< non-empty: device memory is too small for all triangles, `full` is the simple mesh
  Mesh rough;              ///< coarsest mesh, for small shadow maps; positions only
  std::vector<std::unique_ptr<gpu::Texture>> textures;
  std::unique_ptr<gpu::Buffer> samples;  ///< of the surface: position, area; normal, 0; emission, 0; model frame
  int sample_count = 0;
  float area_m2 = 0;
  float volume_m3 = 0;  ///< of a closed surface
  std::vector<float> part_area_m2;
  /// Of its own materials, as in Material; mean over its area.
  Eigen::Vector3f max_emission = Eigen::Vector3f::Zero(), mean_emission = Eigen::Vector3f::Zero();
  struct Grid {
    std::unique_ptr<gpu::Texture> distance, reflectance;  ///< reflectance for uniform incident light
    Eigen::Vector3f origin_m = Eigen::Vector3f::Zero();
    float voxel_m = 0;
  };
  /// Of a pose it is made when it is asked for first: between the rounds of live settings no frame needs it.
  const Grid& grid() const {
    if (make_grid) make_grid(made_grid);  // which may throw gpu::GpuError
    make_grid = nullptr;
    return made_grid;
  }
  mutable Grid made_grid;
  mutable std::function<void(Grid&)> make_grid;  ///< null: it is made
  BoundingSphere sphere;                         ///< model frame
};

/// A visible object of a frame.
struct PlacedObject {
  std::shared_ptr<const StoredModel> stored;
  Eigen::Affine3f T_tag_model = Eigen::Affine3f::Identity();
  MaterialOverride material;
  float white_radiance = 1;  ///< of emission 1, W/sr/m²
  PlacedBounds bounds;

  /// Of its brightest material, W/sr/m²; 0: it does not emit.
  Eigen::Vector3f emission() const { return white_radiance * material.emission.value_or(stored->max_emission); }
  bool emits() const { return emission().maxCoeff() > 0; }
  Eigen::Vector3f mean_emission() const { return white_radiance * material.emission.value_or(stored->mean_emission); }
  bool operator==(const PlacedObject& o) const;
};

/// Whether both are of the same models, at any place and in any pose.
bool same_models(const std::vector<PlacedObject>& a, const std::vector<PlacedObject>& b);

class ObjectStore {
 public:
  explicit ObjectStore(gpu::Device& device);
  /// The exhibit without visible objects whose models are not on the device yet, which `preparing` names. Each call
  /// uploads at most frame_bytes of prepared ones, or one part of a model that is larger.
  Exhibit ready(const Exhibit& exhibit, const UploadModels& models, std::vector<std::string>* preparing);
  /// The visible objects at a time; what their models lack is prepared and uploaded at once. Releases models that no
  /// object uses any more.
  std::vector<PlacedObject> place(const Exhibit& exhibit, double time_s);
  /// Uploads triangles without textures, for surfaces that are not virtual.
  StoredModel::Mesh upload_mesh(const Model& model);
  const gpu::Texture& white() const {
    return *white_;
  }  ///< bound where a shader declares a texture that a part does not have

 private:
  struct Upload {
    std::size_t bytes = 0;
    std::function<void()> run;
  };
  struct Entry {
    std::shared_ptr<StoredModel> stored;
    std::deque<Upload> uploads;  ///< that remain
  };
  std::deque<Upload> uploads(const std::shared_ptr<const UploadModel>& from, StoredModel& to);
  Entry& entry_of(const std::shared_ptr<const Model>& model, const std::shared_ptr<const UploadModel>& prepared);
  static std::size_t upload_next(Entry& entry);
  const std::shared_ptr<StoredModel>& stored(const std::shared_ptr<const Model>& model);
  std::shared_ptr<const StoredModel> posed(const std::shared_ptr<const StoredModel>& at_rest, RigPose pose);
  std::unique_ptr<gpu::Buffer> upload_vertices(const Model& model);
  StoredModel::Mesh posed_mesh(const StoredModel::Mesh& at_rest, const Model& posed);

  gpu::Device& device_;
  std::unique_ptr<gpu::Texture> white_;
  std::vector<std::shared_ptr<const StoredModel>> posed_;  ///< of the last frame
  std::map<const Model*, Entry> models_;
};

using shader::kVertexFloats;
gpu::RasterDesc vertex_raster(const char* vertex_shader, const char* fragment_shader,
                              std::vector<gpu::Format> color_formats);  ///< draws such vertices

}  // namespace lumigraft::relight
