#include "relight/gpu/vulkan/recording.h"

#include <algorithm>
#include <cstring>

namespace lumigraft::relight::gpu::vulkan {

constexpr std::uint32_t sets_per_pool = 128;
constexpr std::size_t params_chunk_bytes = 256 * 1024;
constexpr int timestamps_per_pool = 64;

Recording::Recording(Context& context) : context_(context) {
  auto pool = zeroed<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool.queueFamilyIndex = context_.queue_family();
  check(vkCreateCommandPool(context_.device(), &pool, nullptr, &pool_), "creating a command pool");
  const VkResult result = allocate_commands(context_.device(), pool_, &commands);
  if (result != VK_SUCCESS) vkDestroyCommandPool(context_.device(), pool_, nullptr);
  check(result, "creating a command list");
}

Recording::~Recording() {
  if (context_.hung()) return;
  for (const VkQueryPool pool : queries_) vkDestroyQueryPool(context_.device(), pool, nullptr);
  for (AllocatedBuffer& buffer : params_) context_.destroy(buffer);
  for (const VkDescriptorPool pool : descriptor_pools_) vkDestroyDescriptorPool(context_.device(), pool, nullptr);
  vkDestroyCommandPool(context_.device(), pool_, nullptr);
}

void Recording::begin() {
  context_.throw_if_hung();
  check(vkResetCommandPool(context_.device(), pool_, 0), "resetting a command list");
  for (const VkDescriptorPool pool : descriptor_pools_) {
    check(vkResetDescriptorPool(context_.device(), pool, 0), "resetting a command list");
  }
  descriptor_pool_ = params_chunk_ = params_used_ = 0;
  timestamps_ = 0;
  begin_once(commands, "beginning a command list");
}

VkDescriptorPool Recording::create_descriptor_pool() {
  const VkDescriptorPoolSize sizes[] = {
      {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, sets_per_pool},
      {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 8 * sets_per_pool},
      {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 8 * sets_per_pool},
      {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 8 * sets_per_pool},
  };
  auto info = zeroed<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  info.maxSets = sets_per_pool;
  info.poolSizeCount = std::size(sizes);
  info.pPoolSizes = sizes;
  VkDescriptorPool pool = VK_NULL_HANDLE;
  check(vkCreateDescriptorPool(context_.device(), &info, nullptr, &pool), "creating a descriptor pool");
  return pool;
}

VkDescriptorSet Recording::allocate_set(VkDescriptorSetLayout layout) {
  while (true) {
    const bool fresh = descriptor_pool_ == descriptor_pools_.size();
    if (fresh) descriptor_pools_.push_back(create_descriptor_pool());
    const VkDescriptorSetAllocateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                           .pNext = nullptr,
                                           .descriptorPool = descriptor_pools_[descriptor_pool_],
                                           .descriptorSetCount = 1,
                                           .pSetLayouts = &layout};
    VkDescriptorSet set = VK_NULL_HANDLE;
    const VkResult result = vkAllocateDescriptorSets(context_.device(), &info, &set);
    if (result == VK_SUCCESS) return set;
    const bool full = result == VK_ERROR_OUT_OF_POOL_MEMORY || result == VK_ERROR_FRAGMENTED_POOL;
    if (!full || fresh) check(result, "allocating a descriptor set");
    ++descriptor_pool_;
  }
}

VkDescriptorBufferInfo Recording::copy_params(std::span<const std::byte> bytes, std::size_t padded_bytes) {
  const std::size_t alignment = std::max<std::size_t>(context_.limits().minUniformBufferOffsetAlignment, 16);
  std::size_t offset = (params_used_ + alignment - 1) / alignment * alignment;
  if (params_chunk_ < params_.size() && offset + padded_bytes > params_chunk_bytes) {
    ++params_chunk_;
    offset = 0;
  }
  if (params_chunk_ == params_.size()) {
    params_.push_back(
        context_.create_buffer(params_chunk_bytes, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, MemoryUse::to_device));
    offset = 0;
  }
  const AllocatedBuffer& chunk = params_[params_chunk_];
  std::memset(chunk.memory.mapped + offset, 0, padded_bytes);
  std::memcpy(chunk.memory.mapped + offset, bytes.data(), bytes.size());
  params_used_ = offset + padded_bytes;
  return {chunk.handle, offset, padded_bytes};
}

void Recording::write_timestamp() {
  const std::size_t pool = static_cast<std::size_t>(timestamps_ / timestamps_per_pool);
  if (pool == queries_.size()) {
    auto info = zeroed<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
    info.queryType = VK_QUERY_TYPE_TIMESTAMP;
    info.queryCount = timestamps_per_pool;
    VkQueryPool created = VK_NULL_HANDLE;
    check(vkCreateQueryPool(context_.device(), &info, nullptr, &created), "creating timestamps");
    queries_.push_back(created);
  }
  const std::uint32_t query = static_cast<std::uint32_t>(timestamps_ % timestamps_per_pool);
  if (query == 0) vkCmdResetQueryPool(commands, queries_[pool], 0, timestamps_per_pool);
  vkCmdWriteTimestamp2(commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, queries_[pool], query);
  ++timestamps_;
}

std::vector<std::uint64_t> Recording::read_timestamps() {
  std::vector<std::uint64_t> ticks(static_cast<std::size_t>(timestamps_));
  for (std::size_t first = 0; first < ticks.size(); first += timestamps_per_pool) {
    const std::size_t count = std::min<std::size_t>(timestamps_per_pool, ticks.size() - first);
    check(vkGetQueryPoolResults(context_.device(), queries_[first / timestamps_per_pool], 0,
                                static_cast<std::uint32_t>(count), count * sizeof(std::uint64_t), &ticks[first],
                                sizeof(std::uint64_t), VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
          "reading timestamps");
  }
  return ticks;
}

RecordingLease::RecordingLease(std::shared_ptr<Context> context) : context_(std::move(context)) {
  if (context_->spare_recordings.empty()) {
    recording_ = std::make_unique<Recording>(*context_);
  } else {
    recording_ = std::move(context_->spare_recordings.back());
    context_->spare_recordings.pop_back();
  }
  recording_->begin();
}

}  // namespace lumigraft::relight::gpu::vulkan
