#pragma once
// Uploads that wait for the next submission, which executes them before its own commands: to submit and wait for each
// of a frame's dozen uploads took longer than the frame's own commands.
#include "relight/gpu/vulkan/context.h"

namespace lumigraft::relight::gpu::vulkan {

class PendingUploads {
 public:
  explicit PendingUploads(Context& context);
  ~PendingUploads();
  PendingUploads(const PendingUploads&) = delete;
  PendingUploads& operator=(const PendingUploads&) = delete;

  bool any() const { return recording_; }
  /// Bytes to upload that the next submission holds.
  std::size_t bytes() const { return bytes_; }
  /// Host memory for `bytes`, to be written before the next submission. `record(commands, buffer, offset)` records the
  /// copy from the place in a buffer that this memory is.
  std::byte* add(std::size_t bytes, const std::function<void(VkCommandBuffer, VkBuffer, VkDeviceSize)>& record);
  /// Commands to submit. After their execution, or its failure, the memory is reused.
  VkCommandBuffer end();

 private:
  void begin();

  Context& context_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  std::vector<AllocatedBuffer> chunks_;
  std::size_t used_ = 0;   ///< bytes of the last chunk
  std::size_t bytes_ = 0;  ///< of all uploads since the last submission
  std::size_t chunk_bytes_;
  bool recording_ = false;
};

}  // namespace lumigraft::relight::gpu::vulkan
