#pragma once
// Programs, linked from the GLSL that the shaders' SPIR-V became.
#include <map>

#include "relight/gpu/egl/context.h"
#include "relight/gpu/shader_reflection.h"

namespace lumigraft::relight::gpu::egl {

/// The OpenGL objects of either kind of pipeline.
struct PipelineObjects {
  explicit PipelineObjects(std::shared_ptr<Context> context_of_all) : context(std::move(context_of_all)) {}
  ~PipelineObjects();
  PipelineObjects(const PipelineObjects&) = delete;
  PipelineObjects& operator=(const PipelineObjects&) = delete;

  /// Wants a Current and the interface. Throws GpuError with what the driver says; nothing is linked then.
  void link(std::span<const std::pair<GLenum, const ShaderCode*>> stages);

  std::shared_ptr<Context> context;
  std::string name;  ///< of the shader or shaders, for messages
  ShaderInterface interface;
  std::map<int, int> units;  ///< by slot, of the kind of the slot
  GLuint program = 0;
  GLuint vertex_array = 0;  ///< raster alone
};

class EglCompute final : public ComputePipeline {
 public:
  EglCompute(std::shared_ptr<Context> context, const ShaderCode& shader);
  /// Compiles the shader when it is first asked for: many passes are made of which a plan runs a few.
  const PipelineObjects& objects() const;

 private:
  ShaderCode shader_;
  mutable PipelineObjects objects_;
};

class EglRaster final : public RasterPipeline {
 public:
  EglRaster(std::shared_ptr<Context> context, const RasterDesc& desc, const ShaderCode& vertex,
            const ShaderCode& fragment);
  const PipelineObjects& objects() const { return objects_; }
  const RasterDesc& desc() const { return desc_; }

 private:
  void create_vertex_array();

  PipelineObjects objects_;
  RasterDesc desc_;
};

}  // namespace lumigraft::relight::gpu::egl
