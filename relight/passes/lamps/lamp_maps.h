#pragma once
// Shadow maps of the objects: depth from several points of each lamp, whose mean is the penumbra (Heckbert & Herf
// 1997). Surfaces thinner than a voxel cast full shadows too. What moved in the room since it was fused has maps from
// the same points: it occludes the lamps from objects, and where it does the objects' shadows take no light away; so do
// shadows of it that the camera sees. In: objects, lamps, moved surfaces, observed shadows. Out: bindings(), and the
// number of maps per lamp in the frame's parameters.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/observed_shadows.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

class LampMaps {
 public:
  /// About `max_maps` maps of edge² texels (edge a multiple of 32) for all of at most `max_lamps` lamps together, at
  /// least one each; 0: none.
  LampMaps(gpu::Device& device, int edge, int max_maps, int max_lamps);

  /// Distributes the maps among the lamps and writes their number to `params`. A lamp inside the sphere around the
  /// objects gets none: no map covers its field of view. `moved`: triangles of what moved, tag frame; null: nothing.
  void choose(gpu::Device& device, shader::FrameParams& params, const Model* moved = nullptr);
  /// Before `choose`: shadows of what moved that the camera sees; null: none. `lamp_ids`: of the lamps of `params`.
  void observe(gpu::Device& device, shader::FrameParams& params,
               const std::shared_ptr<const reconstruct::LampShadows>& shadows, const std::vector<int>& lamp_ids);
  /// Whether what moved may occlude a lamp of `params` from the sphere around the objects, or a surface behind it.
  static bool may_occlude(const shader::FrameParams& params, const Eigen::Vector3f& p_m);
  /// Whether moved triangles that may occlude a lamp, or observed shadows, differ from those that were recorded last.
  bool moved_anew() const { return moved_anew_; }
  /// All maps. `rough`: draw the objects' coarsest meshes.
  void record(gpu::CommandList& list, const std::vector<PlacedObject>& objects, bool rough, const gpu::Texture& white);
  /// Those of what moved alone; the lamps and the sphere around the objects are those of the last `record`.
  void record_moved(gpu::CommandList& list);

  /// For passes that include lamp_maps.glsl.
  std::vector<gpu::Binding> bindings() const;

 private:
  std::vector<gpu::Binding> map_bindings() const;
  void take_moved(gpu::Device& device, const shader::FrameParams& params, const Model* moved);

  int edge_, max_maps_;
  std::unique_ptr<gpu::RasterPipeline> raster_, raster_moved_;
  std::unique_ptr<gpu::ComputePipeline> bound_;
  std::unique_ptr<gpu::Texture> depths_;  ///< the maps side by side; those of what moved in its lower half
  std::unique_ptr<gpu::Buffer> views_, bounds_;
  ObservedShadows observed_;
  std::vector<shader::DrawParams> draws_, draws_moved_;
  // What moved.
  std::vector<float> moved_m_;     ///< corners of triangles
  Eigen::AlignedBox3f moved_box_;  ///< encloses them
  std::unique_ptr<gpu::Buffer> corners_, indices_;
  bool moved_anew_ = false;
};

}  // namespace lumigraft::relight
