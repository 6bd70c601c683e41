#pragma once
// Programs, linked from GLSL that was converted from the shaders' SPIR-V.
#include <map>

#include "relight/gpu/egl/context.h"
#include "relight/gpu/shader_reflection.h"

namespace lumigraft::relight::gpu::egl {

/// OpenGL objects of a compute or raster pipeline.
struct PipelineObjects {
  explicit PipelineObjects(std::shared_ptr<Context> context_of_all) : context(std::move(context_of_all)) {}
  ~PipelineObjects();
  PipelineObjects(const PipelineObjects&) = delete;
  PipelineObjects& operator=(const PipelineObjects&) = delete;

  /// Requires a Current and the interface. Throws GpuError with the driver's message, without leaving a program linked.
  void link(std::span<const std::pair<GLenum, const ShaderCode*>> stages);

  std::shared_ptr<Context> context;
  std::string name;  ///< of the shader or shaders, for error messages
  ShaderInterface interface;
  std::map<int, int> units;  ///< by slot, per kind of slot
  GLuint program = 0;
  GLuint vertex_array = 0;  ///< raster only
};

class EglCompute final : public ComputePipeline {
 public:
  EglCompute(std::shared_ptr<Context> context, const ShaderCode& shader);
  /// Compiles the shader at its first use: a plan runs only a few of the passes that are created.
  const PipelineObjects& objects() const;
  const Context* context() const { return objects_.context.get(); }

 private:
  ShaderCode shader_;
  mutable PipelineObjects objects_;
};

class EglRaster final : public RasterPipeline {
 public:
  EglRaster(std::shared_ptr<Context> context, const RasterDesc& desc, const ShaderCode& vertex,
            const ShaderCode& fragment);
  const PipelineObjects& objects() const { return objects_; }
  const Context* context() const { return objects_.context.get(); }
  const RasterDesc& desc() const { return desc_; }

 private:
  void create_vertex_array();

  PipelineObjects objects_;
  RasterDesc desc_;
};

}  // namespace lumigraft::relight::gpu::egl
