#pragma once
// Selection among the machine's Vulkan devices, with the reason for each rejection.
#include "relight/gpu/vulkan/context.h"

namespace lumigraft::relight::gpu::vulkan {

struct Candidate {
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  std::string name;
  VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
  std::string rejection_reason;  ///< empty: usable
};
/// Discrete GPUs first, software last. Throws GpuError if there are none.
std::vector<Candidate> find_candidates(const Instance& instance);

/// Throws GpuError.
Choice choose_device(const Instance& instance);

VkFormat vk_format(Format format);

}  // namespace lumigraft::relight::gpu::vulkan
