#include "relight/gpu/vulkan/choose_device.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <optional>

#include "relight/gpu/backends.h"
#include "relight/gpu/formats.h"

namespace lumigraft::relight::gpu::vulkan {
namespace {

constexpr FormatTable<VkFormat> vk_formats{{VK_FORMAT_R8_UNORM, VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_R8G8B8A8_SRGB,
                                            VK_FORMAT_R16_SFLOAT, VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_R32_SFLOAT,
                                            VK_FORMAT_R32G32_SFLOAT, VK_FORMAT_R32G32B32A32_SFLOAT,
                                            VK_FORMAT_D32_SFLOAT}};

constexpr std::pair<VkFormatFeatureFlags, const char*> feature_names[] = {
    {VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT, "sampling"},
    {VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT, "linear filtering"},
    {VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT, "storage"},
    {VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT, "drawing to"},
    {VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT, "depth tests"},
    {VK_FORMAT_FEATURE_TRANSFER_SRC_BIT, "copying from"},
    {VK_FORMAT_FEATURE_TRANSFER_DST_BIT, "copying to"},
};

VkFormatFeatureFlags wanted_features(Format format) {
  VkFormatFeatureFlags wanted =
      VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT | VK_FORMAT_FEATURE_TRANSFER_SRC_BIT | VK_FORMAT_FEATURE_TRANSFER_DST_BIT;
  if (is_depth(format)) return wanted | VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT;
  if (!is_storable(format)) return wanted | VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT;
  return wanted | VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT | VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT |
         VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT;
}

int rank(VkPhysicalDeviceType type) {
  constexpr std::array types = {VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU, VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU,
                                VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU};
  return static_cast<int>(std::find(types.begin(), types.end(), type) - types.begin());
}

/// The device with a queue for graphics, compute and timestamps.
std::optional<Choice> with_queue(VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  constexpr VkQueueFlags wanted = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t timestamp_bits = families[i].timestampValidBits;
    if ((families[i].queueFlags & wanted) == wanted && timestamp_bits > 0) return Choice{device, i, timestamp_bits};
  }
  return std::nullopt;
}

/// Missing features of the device; empty if it can be used.
std::string missing(VkPhysicalDevice device, const VkPhysicalDeviceProperties& properties) {
  if (properties.apiVersion < VK_API_VERSION_1_3) {  // the queries below require 1.3
    return "it has Vulkan " + std::to_string(VK_API_VERSION_MAJOR(properties.apiVersion)) + "." +
           std::to_string(VK_API_VERSION_MINOR(properties.apiVersion)) + ", not 1.3";
  }
  std::string reasons;
  const auto add = [&](const std::string& reason) { reasons += (reasons.empty() ? "" : ", ") + reason; };
  if (!with_queue(device)) add("it has no queue for drawing, compute and timestamps");

  VkPhysicalDeviceFeatures features{};
  vkGetPhysicalDeviceFeatures(device, &features);
  if (!features.shaderStorageImageExtendedFormats) add("it lacks shaderStorageImageExtendedFormats");

  for (std::size_t i = 0; i < vk_formats.values.size(); ++i) {
    const auto format = static_cast<Format>(i);
    VkFormatProperties format_properties{};
    vkGetPhysicalDeviceFormatProperties(device, vk_format(format), &format_properties);
    const VkFormatFeatureFlags lacking = wanted_features(format) & ~format_properties.optimalTilingFeatures;
    for (const auto& [flag, name] : feature_names) {
      if (lacking & flag) add(std::string(name_of(format)) + " lacks " + name);
    }
  }
  return reasons;
}

}  // namespace

VkFormat vk_format(Format format) { return vk_formats[format]; }

std::vector<Candidate> find_candidates(const Instance& instance) {
  std::uint32_t count = 0;
  check(vkEnumeratePhysicalDevices(instance.handle, &count, nullptr), "listing the Vulkan devices");
  std::vector<VkPhysicalDevice> devices(count);
  check(vkEnumeratePhysicalDevices(instance.handle, &count, devices.data()), "listing the Vulkan devices");
  if (devices.empty()) throw GpuError(no_driver_text());
  std::vector<Candidate> candidates;
  for (const VkPhysicalDevice device : devices) {
    VkPhysicalDeviceProperties properties{};
    vkGetPhysicalDeviceProperties(device, &properties);
    candidates.push_back({.physical = device,
                          .name = properties.deviceName,
                          .type = properties.deviceType,
                          .rejection_reason = missing(device, properties)});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return rank(a.type) < rank(b.type); });
  return candidates;
}

Choice choose_device(const Instance& instance) {
  const char* wanted_name = std::getenv("LUMIGRAFT_VULKAN_DEVICE");
  std::string reasons;
  for (const Candidate& candidate : find_candidates(instance)) {
    const bool wanted = !wanted_name || candidate.name.find(wanted_name) != std::string::npos;
    if (wanted && candidate.rejection_reason.empty()) return *with_queue(candidate.physical);
    reasons += "; " + candidate.name + ": ";
    reasons +=
        wanted ? candidate.rejection_reason : std::string("LUMIGRAFT_VULKAN_DEVICE asks for \"") + wanted_name + "\"";
  }
  throw GpuError("no usable Vulkan device" + reasons);
}

std::vector<DeviceListing> list_devices() {
  std::vector<DeviceListing> listings;
  try {
    const Instance instance(false);
    for (Candidate& candidate : find_candidates(instance)) {
      listings.push_back({.backend = Backend::vulkan,
                          .name = std::move(candidate.name),
                          .software = candidate.type == VK_PHYSICAL_DEVICE_TYPE_CPU,
                          .rejection_reason = std::move(candidate.rejection_reason)});
    }
  } catch (const GpuError& e) {
    listings.push_back({.backend = Backend::vulkan, .name = "Vulkan", .rejection_reason = e.what()});
  }
  return listings;
}

}  // namespace lumigraft::relight::gpu::vulkan
