#pragma once
// What the GPU holds of virtual models: triangles, textures, distance fields. Made once per model.
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "relight/exhibit/exhibit.h"
#include "relight/gpu/device.h"
#include "relight/objects/placement.h"

namespace lumigraft::relight {

struct StoredModel {
  struct Mesh {
    std::unique_ptr<gpu::Buffer> vertices;  ///< position, normal, texcoord, colour: 11 floats
    int vertex_count = 0;
    bool closed = false;  ///< of `simple`: every edge joins two triangles that run it in opposite ways
    struct Part {
      std::unique_ptr<gpu::Buffer> indices;
      std::uint32_t index_count = 0;
      Material material;
      const gpu::Texture* texture = nullptr;  ///< null where it has none
    };
    std::vector<Part> parts;
  };
  std::shared_ptr<const Model> model;
  Mesh full, simple;       ///< simple: fewer triangles where there are many, more where there are few large ones
  std::string why_simple;  ///< not empty: the device has no room for all triangles, `full` is the simple mesh too
  Mesh rough;              ///< as few as a small shadow map needs; positions alone count
  std::vector<std::unique_ptr<gpu::Texture>> textures;
  std::unique_ptr<gpu::Buffer> samples;  ///< of the surface: position, area; normal, 0; model frame
  int sample_count = 0;
  std::unique_ptr<gpu::Texture> distance, reflectance;  ///< of the grid; reflectance of evenly arriving light
  Eigen::Vector3f grid_origin_m = Eigen::Vector3f::Zero();
  float grid_voxel_m = 0;
  BoundingSphere sphere;  ///< in the model's frame
};

/// One object of a frame.
struct PlacedObject {
  const StoredModel* stored = nullptr;
  Eigen::Affine3f T_tag_model = Eigen::Affine3f::Identity();
  MaterialOverride material;
  PlacedBounds bounds;

  bool operator==(const PlacedObject& o) const;
};

class ObjectStore {
 public:
  explicit ObjectStore(gpu::Device& device);
  ~ObjectStore();
  /// The visible objects at a time. Models that no object uses any more are let go.
  std::vector<PlacedObject> place(const Exhibit& exhibit, double time_s);
  /// Triangles alone, without textures, for surfaces that are not virtual.
  StoredModel::Mesh upload_mesh(const Model& model);
  const gpu::Texture& white() const;  ///< where a shader wants a texture and there is none

 private:
  const StoredModel& stored(const std::shared_ptr<const Model>& model);

  gpu::Device& device_;
  std::unique_ptr<gpu::Texture> white_;
  std::map<const Model*, std::unique_ptr<StoredModel>> models_;
};

constexpr int kVertexFloats = 11;
std::vector<gpu::VertexAttribute> vertex_attributes();

}  // namespace lumigraft::relight
