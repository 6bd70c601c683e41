#pragma once
// Uploads that wait for the next submission, which executes them before its own commands: to submit and wait for each
// of a frame's dozen uploads took longer than the frame's own commands.
#include "relight/gpu/vulkan/recording.h"

namespace lumigraft::relight::gpu::vulkan {

class PendingUploads {
 public:
  /// More than this does not wait: add() may be called for it when nothing else waits.
  static constexpr std::size_t kMax_bytes = 64 * 1024 * 1024;

  explicit PendingUploads(Context& context) : context_(context), recording_(context) {}
  ~PendingUploads();
  PendingUploads(const PendingUploads&) = delete;
  PendingUploads& operator=(const PendingUploads&) = delete;

  bool any() const { return waiting_; }
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
  Recording recording_;
  std::vector<AllocatedBuffer> chunks_;
  std::size_t used_ = 0;   ///< bytes of the last chunk
  std::size_t bytes_ = 0;  ///< of all uploads since the last submission
  std::size_t chunk_bytes_ = 1024 * 1024;
  bool waiting_ = false;
};

}  // namespace lumigraft::relight::gpu::vulkan
