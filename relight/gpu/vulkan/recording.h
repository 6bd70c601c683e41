#pragma once
// Resources of one command list: command buffer, descriptor sets, uniform memory, timestamps. Grows as needed, and is
// reused by later lists.
#include "relight/gpu/vulkan/context.h"

namespace lumigraft::relight::gpu::vulkan {

struct Recording {
  explicit Recording(Context& context);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  void begin();
  VkDescriptorSet allocate_set(VkDescriptorSetLayout layout);
  /// Copies `bytes` to memory that shaders can read; the range is padded to `padded_bytes`.
  VkDescriptorBufferInfo copy_params(std::span<const std::byte> bytes, std::size_t padded_bytes);
  /// Writes the device's time after completion of all previous commands.
  void write_timestamp();
  std::vector<std::uint64_t> read_timestamps();

  VkCommandBuffer commands = VK_NULL_HANDLE;

 private:
  VkDescriptorPool create_descriptor_pool();

  Context& context_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  std::vector<VkDescriptorPool> descriptor_pools_;
  std::size_t descriptor_pool_ = 0;  ///< the one in use
  std::vector<AllocatedBuffer> params_;
  std::size_t params_chunk_ = 0, params_used_ = 0;
  std::vector<VkQueryPool> queries_;
  int timestamps_ = 0;
};

/// Returns the recording to the context on destruction.
class RecordingLease {
 public:
  explicit RecordingLease(std::shared_ptr<Context> context);
  ~RecordingLease() { context_->spare_recordings.push_back(std::move(recording_)); }
  Recording* operator->() const { return recording_.get(); }

 private:
  std::shared_ptr<Context> context_;
  std::unique_ptr<Recording> recording_;
};

}  // namespace lumigraft::relight::gpu::vulkan
