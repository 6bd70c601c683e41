#pragma once
// Records commands with a full memory barrier before each: each pass reads the results of the previous one, so finer
// barriers would gain little.
#include "relight/gpu/texture_clear.h"
#include "relight/gpu/vulkan/pipelines.h"
#include "relight/gpu/vulkan/recording.h"
#include "relight/gpu/vulkan/resources.h"

namespace lumigraft::relight::gpu::vulkan {

class VulkanCommandList final : public CommandList {
 public:
  VulkanCommandList(std::shared_ptr<Context> context, std::shared_ptr<const TextureClear> texture_clear);

  bool is_software() const override { return context_->is_software(); }
  void begin_pass(std::string_view name) override;
  void dispatch(const ComputePipeline& pipeline, std::span<const Binding> bindings, std::span<const std::byte> params,
                int groups_x, int groups_y, int groups_z) override;
  void draw(const RasterPipeline& pipeline, const std::vector<const Texture*>& colors, const Texture& depth,
            std::span<const DrawCall> calls, const Area* area) override;
  void fill(const Buffer& buffer, std::uint32_t value) override;
  void clear(const Texture& texture, std::array<float, 4> value) override;

  /// Executes the commands, waits, and returns the times of the passes.
  std::vector<PassTime> run();
  const Context* context() const { return context_.get(); }

 private:
  void begin_command();
  VkDescriptorSet bind(const PipelineObjects& pipeline, std::span<const Binding> bindings,
                       std::span<const std::byte> params);
  void draw_one(const VulkanRaster& pipeline, const DrawCall& call, VkDescriptorSet set);

  std::shared_ptr<Context> context_;
  std::shared_ptr<const TextureClear> texture_clear_;  ///< null on software devices, whose own clear is fast
  RecordingLease recording_;
  std::vector<std::string> passes_;  ///< one timestamp per pass, and one at the end
  bool submitted_ = false;
};

}  // namespace lumigraft::relight::gpu::vulkan
