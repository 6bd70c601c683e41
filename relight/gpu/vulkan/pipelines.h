#pragma once
// Pipelines with layouts derived from their shaders.
#include "relight/gpu/shader_reflection.h"
#include "relight/gpu/vulkan/context.h"

namespace lumigraft::relight::gpu::vulkan {

/// Vulkan objects of a compute or raster pipeline.
struct PipelineObjects {
  explicit PipelineObjects(std::shared_ptr<Context> context_of_all) : context(std::move(context_of_all)) {}
  ~PipelineObjects();
  PipelineObjects(const PipelineObjects&) = delete;
  PipelineObjects& operator=(const PipelineObjects&) = delete;

  void create_layout(VkShaderStageFlags stages);

  std::shared_ptr<Context> context;
  std::string name;  ///< of the shader or shaders, for error messages
  ShaderInterface interface;
  VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipeline handle = VK_NULL_HANDLE;
};

/// A compute shader's pipeline.
class ComputeObjects {
 public:
  ComputeObjects(std::shared_ptr<Context> context, const ShaderCode& shader);
  /// Compiles the shader at its first use: a plan runs only a few of the passes that are created.
  const PipelineObjects& compiled();
  const Context* context() const { return objects_.context.get(); }

 private:
  ShaderCode shader_;
  PipelineObjects objects_;
};

/// All of one shader on a device share its compiled pipeline.
class VulkanCompute final : public ComputePipeline {
 public:
  explicit VulkanCompute(std::shared_ptr<ComputeObjects> shared) : shared_(std::move(shared)) {}
  const PipelineObjects& objects() const { return shared_->compiled(); }
  const Context* context() const { return shared_->context(); }

 private:
  std::shared_ptr<ComputeObjects> shared_;
};

class VulkanRaster final : public RasterPipeline {
 public:
  VulkanRaster(const std::shared_ptr<Context>& context, const RasterDesc& desc, const ShaderCode& vertex,
               const ShaderCode& fragment);
  const PipelineObjects& objects() const { return objects_; }
  const Context* context() const { return objects_.context.get(); }
  const RasterDesc& desc() const { return desc_; }

 private:
  void create(VkShaderModule vertex, VkShaderModule fragment);

  PipelineObjects objects_;
  RasterDesc desc_;
};

VkDescriptorType descriptor_type(Binding::Kind kind);

}  // namespace lumigraft::relight::gpu::vulkan
