#include "relight/gpu/vulkan/context.h"

#include <optional>

#include "relight/gpu/hang.h"
#include "relight/gpu/vulkan/pending_uploads.h"
#include "relight/gpu/vulkan/recording.h"

namespace lumigraft::relight::gpu::vulkan {

Context::Context(std::unique_ptr<Instance> instance, VkPhysicalDevice physical)
    : instance_(std::move(instance)), physical_(physical) {}

// Uses a delegating constructor, so that the destructor runs if the code below throws.
Context::Context(std::unique_ptr<Instance> instance, const Choice& choice,
                 std::optional<std::chrono::milliseconds> hangs_after)
    : Context(std::move(instance), choice.physical) {
  queue_family_ = choice.queue_family;
  timestamp_bits_ = choice.timestamp_bits;
  vkGetPhysicalDeviceProperties(physical_, &properties_);
  vkGetPhysicalDeviceMemoryProperties(physical_, &memory_properties_);
  hangs_after_ = hangs_after.value_or(is_software() ? kNever_hangs : kHardware_hangs_after);
  create_device();
  create_samplers();
  const auto fence = zeroed<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
  check(vkCreateFence(device_, &fence, nullptr, &fence_), "creating a fence");
  auto pool = zeroed<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
  pool.queueFamilyIndex = queue_family_;
  check(vkCreateCommandPool(device_, &pool, nullptr, &once_pool_), "creating a command pool");
  uploads_ = std::make_unique<PendingUploads>(*this);
}

Context::~Context() {
  if (!device_) return;
  spare_recordings.clear();
  uploads_.reset();
  if (hung_) {
    static_cast<void>(instance_.release());  // NOLINT(bugprone-unused-return-value)
    return;
  }
  destroy(from_device_);
  vkDestroyCommandPool(device_, once_pool_, nullptr);
  vkDestroyFence(device_, fence_, nullptr);
  for (const VkSampler sampler : samplers_) vkDestroySampler(device_, sampler, nullptr);
  vkDestroyDevice(device_, nullptr);
}

void Context::create_device() {
  const float priority = 1.0f;
  auto queue = zeroed<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = queue_family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  auto vulkan13 = zeroed<VkPhysicalDeviceVulkan13Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES);
  vulkan13.synchronization2 = VK_TRUE;
  vulkan13.dynamicRendering = VK_TRUE;
  vulkan13.maintenance4 = VK_TRUE;
  vulkan13.shaderDemoteToHelperInvocation = VK_TRUE;  // what `discard` becomes in SPIR-V 1.6
  vulkan13.shaderTerminateInvocation = VK_TRUE;
  VkPhysicalDeviceFeatures features{};
  features.shaderStorageImageExtendedFormats = VK_TRUE;
  auto info = zeroed<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  info.pNext = &vulkan13;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  info.pEnabledFeatures = &features;
  check(vkCreateDevice(physical_, &info, nullptr, &device_), "opening " + name());
  vkGetDeviceQueue(device_, queue_family_, 0, &queue_);
  if (instance_->validation) {
    set_name_ = reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(
        vkGetInstanceProcAddr(instance_->handle, "vkSetDebugUtilsObjectNameEXT"));
  }
}

VkSamplerAddressMode address_mode(Wrap wrap) {
  switch (wrap) {
    case Wrap::repeat:
      return VK_SAMPLER_ADDRESS_MODE_REPEAT;
    case Wrap::mirrored_repeat:
      return VK_SAMPLER_ADDRESS_MODE_MIRRORED_REPEAT;
    case Wrap::clamp_to_edge:
      break;
  }
  return VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
}

void Context::create_samplers() {
  for (std::size_t i = 0; i < Sampling::kCount; ++i) {
    const Sampling sampling = Sampling::at(i);
    auto info = zeroed<VkSamplerCreateInfo>(VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO);
    info.magFilter = info.minFilter = sampling.filter == Filter::nearest ? VK_FILTER_NEAREST : VK_FILTER_LINEAR;
    info.mipmapMode =
        sampling.filter == Filter::linear_mip_linear ? VK_SAMPLER_MIPMAP_MODE_LINEAR : VK_SAMPLER_MIPMAP_MODE_NEAREST;
    info.addressModeU = address_mode(sampling.wrap_u);
    info.addressModeV = address_mode(sampling.wrap_v);
    info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    info.maxLod = VK_LOD_CLAMP_NONE;
    check(vkCreateSampler(device_, &info, nullptr, &samplers_[i]), "creating a sampler");
  }
}

Memory Context::allocate(const VkMemoryRequirements& needs, MemoryUse use, const std::string& what) {
  constexpr VkMemoryPropertyFlags host = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  const VkMemoryPropertyFlags required = use == MemoryUse::device ? 0 : host;
  VkMemoryPropertyFlags preferred = 0;
  if (use == MemoryUse::device) preferred = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  if (use == MemoryUse::from_device) preferred = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;  // uncached reads are slow

  std::optional<std::uint32_t> best;
  bool best_preferred = false;
  for (std::uint32_t i = 0; i < memory_properties_.memoryTypeCount; ++i) {
    const VkMemoryPropertyFlags flags = memory_properties_.memoryTypes[i].propertyFlags;
    if (!(needs.memoryTypeBits & (1u << i)) || (flags & required) != required) continue;
    const bool is_preferred = (flags & preferred) == preferred;
    if (best && (best_preferred || !is_preferred)) continue;
    best = i;
    best_preferred = is_preferred;
  }
  if (!best) throw GpuError(name() + " has no memory type for " + what);

  Memory memory;
  auto info = zeroed<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  info.allocationSize = needs.size;
  info.memoryTypeIndex = *best;
  check(vkAllocateMemory(device_, &info, nullptr, &memory.handle),
        "allocating " + std::to_string(needs.size) + " bytes for " + what);
  // Software devices, and others with host visible device memory, need no staging.
  if ((memory_properties_.memoryTypes[*best].propertyFlags & host) == host) {
    void* mapped = nullptr;
    const VkResult result = vkMapMemory(device_, memory.handle, 0, VK_WHOLE_SIZE, 0, &mapped);
    if (result != VK_SUCCESS) vkFreeMemory(device_, memory.handle, nullptr);
    check(result, "mapping " + what);
    memory.mapped = static_cast<std::byte*>(mapped);
  }
  return memory;
}

bool Context::host_writes_textures(VkFormat format, VkImageUsageFlags usage, const VkExtent3D& extent) const {
  constexpr VkMemoryPropertyFlags wanted =
      VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT | VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  for (std::uint32_t i = 0; i < memory_properties_.memoryTypeCount; ++i) {
    const VkMemoryPropertyFlags flags = memory_properties_.memoryTypes[i].propertyFlags;
    // Beside memory that the host cannot write, reading what it can is slow: a device of its own, across a bus.
    if ((flags & VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT) && (flags & wanted) != wanted) return false;
  }
  VkImageFormatProperties properties{};
  return vkGetPhysicalDeviceImageFormatProperties(physical_, format, VK_IMAGE_TYPE_2D, VK_IMAGE_TILING_LINEAR, usage, 0,
                                                  &properties) == VK_SUCCESS &&
         extent.width <= properties.maxExtent.width && extent.height <= properties.maxExtent.height;
}

AllocatedBuffer Context::create_buffer(std::size_t size_bytes, VkBufferUsageFlags usage, MemoryUse use,
                                       const std::string& what) {
  AllocatedBuffer buffer;
  buffer.size_bytes = size_bytes;
  auto info = zeroed<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = size_bytes;
  info.usage = usage;
  check(vkCreateBuffer(device_, &info, nullptr, &buffer.handle), "creating " + what);
  try {
    VkMemoryRequirements needs{};
    vkGetBufferMemoryRequirements(device_, buffer.handle, &needs);
    buffer.memory = allocate(needs, use, what);
    check(vkBindBufferMemory(device_, buffer.handle, buffer.memory.handle, 0), "binding " + what);
  } catch (...) {
    destroy(buffer);
    throw;
  }
  return buffer;
}

void Context::destroy(AllocatedBuffer& buffer) {
  if (hung_) return;
  vkDestroyBuffer(device_, buffer.handle, nullptr);
  vkFreeMemory(device_, buffer.memory.handle, nullptr);
  buffer = {};
}

const AllocatedBuffer& Context::download_memory(std::size_t size_bytes) {
  if (from_device_.size_bytes < size_bytes) {
    destroy(from_device_);
    from_device_ = create_buffer(size_bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::from_device);
  }
  return from_device_;
}

std::byte* Context::upload(std::size_t bytes,
                           const std::function<void(VkCommandBuffer, VkBuffer, VkDeviceSize)>& record) {
  if (uploads_->any() && uploads_->bytes() + bytes > PendingUploads::kMax_bytes) finish_uploads();
  return uploads_->add(bytes, record);
}

void Context::finish_uploads() {
  if (uploads_->any()) run_and_wait(VK_NULL_HANDLE, "uploads");
}

void Context::finish_uploads(std::nothrow_t) noexcept {
  try {
    finish_uploads();
  } catch (const GpuError&) {
  }
}

void Context::throw_if_hung() const {
  if (hung_) throw DeviceHung(name() + " hangs");
}

void Context::run_and_wait(VkCommandBuffer commands, const std::string& doing) {
  throw_if_hung();
  std::array<VkCommandBufferSubmitInfo, 2> buffers;
  std::uint32_t count = 0;
  const auto add = [&](VkCommandBuffer buffer) {
    buffers[count] = zeroed<VkCommandBufferSubmitInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO);
    buffers[count++].commandBuffer = buffer;
  };
  if (uploads_ && uploads_->any()) add(uploads_->end());
  if (commands) add(commands);
  auto submit = zeroed<VkSubmitInfo2>(VK_STRUCTURE_TYPE_SUBMIT_INFO_2);
  submit.commandBufferInfoCount = count;
  submit.pCommandBufferInfos = buffers.data();
  check(vkQueueSubmit2(queue_, 1, &submit, fence_), doing);
  hung_ = !ends_within(hangs_after_, [&](std::chrono::nanoseconds slice) {
    const VkResult result = vkWaitForFences(device_, 1, &fence_, VK_TRUE, static_cast<std::uint64_t>(slice.count()));
    if (result != VK_TIMEOUT) check(result, doing);
    return result == VK_SUCCESS;
  });
  throw_if_hung();
  check(vkResetFences(device_, 1, &fence_), doing);
  messages().throw_if_any();
}

void Context::run_once(const std::string& doing, const std::function<void(VkCommandBuffer)>& record) {
  throw_if_hung();
  check(vkResetCommandPool(device_, once_pool_, VK_COMMAND_POOL_RESET_RELEASE_RESOURCES_BIT), doing);
  VkCommandBuffer commands = VK_NULL_HANDLE;
  check(allocate_commands(device_, once_pool_, &commands), doing);
  begin_once(commands, doing);
  full_barrier(commands);
  record(commands);
  full_barrier(commands, true);
  check(vkEndCommandBuffer(commands), doing);
  run_and_wait(commands, doing);
  vkFreeCommandBuffers(device_, once_pool_, 1, &commands);
}

void Context::set_name(VkObjectType type, std::uint64_t handle, const std::string& name) {
  if (!set_name_) return;
  auto info = zeroed<VkDebugUtilsObjectNameInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT);
  info.objectType = type;
  info.objectHandle = handle;
  info.pObjectName = name.c_str();
  check(set_name_(device_, &info), "naming " + name);
}

VkResult allocate_commands(VkDevice device, VkCommandPool pool, VkCommandBuffer* commands) {
  auto info = zeroed<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  info.commandPool = pool;
  info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  info.commandBufferCount = 1;
  return vkAllocateCommandBuffers(device, &info, commands);
}

void begin_once(VkCommandBuffer commands, const std::string& doing) {
  auto info = zeroed<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(vkBeginCommandBuffer(commands, &info), doing);
}

void full_barrier(VkCommandBuffer commands, bool to_host) {
  auto barrier = zeroed<VkMemoryBarrier2>(VK_STRUCTURE_TYPE_MEMORY_BARRIER_2);
  barrier.srcStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
  barrier.dstStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT | (to_host ? VK_PIPELINE_STAGE_2_HOST_BIT : 0);
  barrier.srcAccessMask = VK_ACCESS_2_MEMORY_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT;
  auto dependency = zeroed<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  dependency.memoryBarrierCount = 1;
  dependency.pMemoryBarriers = &barrier;
  vkCmdPipelineBarrier2(commands, &dependency);
}

}  // namespace lumigraft::relight::gpu::vulkan
