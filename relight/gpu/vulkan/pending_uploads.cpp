#include "relight/gpu/vulkan/pending_uploads.h"

#include <algorithm>

namespace lumigraft::relight::gpu::vulkan {
namespace {

constexpr std::size_t kLeastChunk_bytes = 1024 * 1024;
constexpr std::size_t kLargestKept_bytes = 64 * 1024 * 1024;  ///< larger chunks are freed after use
constexpr std::size_t kAlignment_bytes = 16;                  ///< of copies to images: a multiple of their texels' size

}  // namespace

PendingUploads::PendingUploads(Context& context) : context_(context), chunk_bytes_(kLeastChunk_bytes) {
  auto pool = zeroed<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool.queueFamilyIndex = context_.queue_family();
  check(vkCreateCommandPool(context_.device(), &pool, nullptr, &pool_), "creating a command pool");
  const VkResult result = allocate_commands(context_.device(), pool_, &commands_);
  if (result != VK_SUCCESS) vkDestroyCommandPool(context_.device(), pool_, nullptr);
  check(result, "creating commands for uploads");
}

PendingUploads::~PendingUploads() {
  for (AllocatedBuffer& chunk : chunks_) context_.destroy(chunk);
  vkDestroyCommandPool(context_.device(), pool_, nullptr);
}

/// One chunk, as large as all that were used last, is kept.
void PendingUploads::begin() {
  chunk_bytes_ = std::clamp(bytes_, chunk_bytes_, kLargestKept_bytes);
  if (chunks_.size() > 1 || (!chunks_.empty() && chunks_.front().size_bytes > kLargestKept_bytes)) {
    for (AllocatedBuffer& chunk : chunks_) context_.destroy(chunk);
    chunks_.clear();
  }
  used_ = bytes_ = 0;
  check(vkResetCommandPool(context_.device(), pool_, 0), "resetting commands for uploads");
  begin_once(commands_, "beginning uploads");
  recording_ = true;
}

std::byte* PendingUploads::add(std::size_t bytes,
                               const std::function<void(VkCommandBuffer, VkBuffer, VkDeviceSize)>& record) {
  if (!recording_) begin();
  if (chunks_.empty() || used_ + bytes > chunks_.back().size_bytes) {
    chunks_.push_back(context_.create_buffer(std::max(bytes, chunk_bytes_), VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                             MemoryUse::to_device, "uploads"));
    used_ = 0;
  }
  const AllocatedBuffer& chunk = chunks_.back();
  full_barrier(commands_);  // another upload may go to the same place
  record(commands_, chunk.handle, used_);
  std::byte* const memory = chunk.memory.mapped + used_;
  used_ += (bytes + kAlignment_bytes - 1) / kAlignment_bytes * kAlignment_bytes;
  bytes_ += bytes;
  return memory;
}

VkCommandBuffer PendingUploads::end() {
  recording_ = false;
  full_barrier(commands_);
  check(vkEndCommandBuffer(commands_), "ending uploads");
  return commands_;
}

}  // namespace lumigraft::relight::gpu::vulkan
