#pragma once
// Which of the machine's devices to use, and why not the others.
#include "relight/gpu/vulkan/context.h"

namespace lumigraft::gpu::vulkan {

struct Choice {
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  std::uint32_t queue_family = 0;
};
/// Throws GpuError.
Choice choose_device(const Instance& instance);

VkFormat vk_format(Format format);

}  // namespace lumigraft::gpu::vulkan
