#include "relight/gpu/vulkan/pending_uploads.h"

#include <algorithm>

namespace lumigraft::relight::gpu::vulkan {
namespace {

constexpr std::size_t kAlignment_bytes = 16;  // of copies to images: a multiple of their texels' size

}  // namespace

PendingUploads::~PendingUploads() {
  for (AllocatedBuffer& chunk : chunks_) context_.destroy(chunk);
}

/// One chunk, as large as all that were used last, is kept.
void PendingUploads::begin() {
  chunk_bytes_ = std::clamp(bytes_, chunk_bytes_, kMax_bytes);
  if (chunks_.size() > 1 || (!chunks_.empty() && chunks_.front().size_bytes > kMax_bytes)) {
    for (AllocatedBuffer& chunk : chunks_) context_.destroy(chunk);
    chunks_.clear();
  }
  used_ = bytes_ = 0;
  recording_.begin();
  waiting_ = true;
}

std::byte* PendingUploads::add(std::size_t bytes,
                               const std::function<void(VkCommandBuffer, VkBuffer, VkDeviceSize)>& record) {
  if (!waiting_) begin();
  if (chunks_.empty() || used_ + bytes > chunks_.back().size_bytes) {
    chunks_.push_back(context_.create_buffer(std::max(bytes, chunk_bytes_), VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                             MemoryUse::to_device, "uploads"));
    used_ = 0;
  }
  const AllocatedBuffer& chunk = chunks_.back();
  full_barrier(recording_.commands);  // another upload may go to the same place
  record(recording_.commands, chunk.handle, used_);
  std::byte* const memory = chunk.memory.mapped + used_;
  used_ += (bytes + kAlignment_bytes - 1) / kAlignment_bytes * kAlignment_bytes;
  bytes_ += bytes;
  return memory;
}

VkCommandBuffer PendingUploads::end() {
  waiting_ = false;
  full_barrier(recording_.commands);
  check(vkEndCommandBuffer(recording_.commands), "ending uploads");
  return recording_.commands;
}

}  // namespace lumigraft::relight::gpu::vulkan
