#include "relight/gpu/vulkan/choose_device.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "relight/gpu/formats.h"

namespace lumigraft::gpu::vulkan {
namespace {

constexpr Format all_formats[] = {Format::r8_unorm,     Format::rgba8_unorm, Format::r16_float,
                                  Format::rgba16_float, Format::r32_float,   Format::rg32_float,
                                  Format::rgba32_float, Format::r32_uint,    Format::depth32_float};

constexpr std::pair<VkFormatFeatureFlags, const char*> feature_names[] = {
    {VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT, "sampling"},
    {VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT, "linear filtering"},
    {VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT, "storage"},
    {VK_FORMAT_FEATURE_STORAGE_IMAGE_ATOMIC_BIT, "storage atomics"},
    {VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT, "drawing to"},
    {VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT, "depth tests"},
    {VK_FORMAT_FEATURE_TRANSFER_SRC_BIT, "copying from"},
    {VK_FORMAT_FEATURE_TRANSFER_DST_BIT, "copying to"},
};

VkFormatFeatureFlags wanted_features(Format format) {
  VkFormatFeatureFlags wanted =
      VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT | VK_FORMAT_FEATURE_TRANSFER_SRC_BIT | VK_FORMAT_FEATURE_TRANSFER_DST_BIT;
  if (is_depth(format)) return wanted | VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT;
  wanted |= VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT | VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT;
  if (is_integer(format)) return wanted | VK_FORMAT_FEATURE_STORAGE_IMAGE_ATOMIC_BIT;
  return wanted | VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT;
}

int rank(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 0;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 1;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 2;
    default:
      return 3;
  }
}

/// A family that draws, computes and tells the time.
std::optional<std::uint32_t> find_queue_family(VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  constexpr VkQueueFlags wanted = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
  for (std::uint32_t i = 0; i < count; ++i) {
    if ((families[i].queueFlags & wanted) == wanted && families[i].timestampValidBits > 0) return i;
  }
  return std::nullopt;
}

/// What the device lacks; empty where it can be used.
std::vector<std::string> missing(VkPhysicalDevice device, const VkPhysicalDeviceProperties& properties) {
  std::vector<std::string> reasons;
  if (properties.apiVersion < VK_API_VERSION_1_3) {
    reasons.push_back("it has Vulkan " + std::to_string(VK_API_VERSION_MAJOR(properties.apiVersion)) + "." +
                      std::to_string(VK_API_VERSION_MINOR(properties.apiVersion)) + ", not 1.3");
    return reasons;  // the rest may not even be asked for
  }
  if (!find_queue_family(device)) reasons.push_back("it has no queue for drawing, compute and timestamps");

  VkPhysicalDeviceFeatures features{};
  vkGetPhysicalDeviceFeatures(device, &features);
  if (!features.shaderStorageImageExtendedFormats) reasons.push_back("it lacks shaderStorageImageExtendedFormats");

  for (const Format format : all_formats) {
    VkFormatProperties format_properties{};
    vkGetPhysicalDeviceFormatProperties(device, vk_format(format), &format_properties);
    const VkFormatFeatureFlags lacking = wanted_features(format) & ~format_properties.optimalTilingFeatures;
    for (const auto& [flag, name] : feature_names) {
      if (lacking & flag) reasons.push_back(std::string(name_of(format)) + " lacks " + name);
    }
  }
  return reasons;
}

}  // namespace

VkFormat vk_format(Format format) {
  switch (format) {
    case Format::r8_unorm:
      return VK_FORMAT_R8_UNORM;
    case Format::rgba8_unorm:
      return VK_FORMAT_R8G8B8A8_UNORM;
    case Format::r16_float:
      return VK_FORMAT_R16_SFLOAT;
    case Format::rgba16_float:
      return VK_FORMAT_R16G16B16A16_SFLOAT;
    case Format::r32_float:
      return VK_FORMAT_R32_SFLOAT;
    case Format::rg32_float:
      return VK_FORMAT_R32G32_SFLOAT;
    case Format::rgba32_float:
      return VK_FORMAT_R32G32B32A32_SFLOAT;
    case Format::r32_uint:
      return VK_FORMAT_R32_UINT;
    case Format::depth32_float:
      return VK_FORMAT_D32_SFLOAT;
  }
  throw std::logic_error("gpu: unknown format");
}

Choice choose_device(const Instance& instance) {
  std::uint32_t count = 0;
  check(vkEnumeratePhysicalDevices(instance.handle, &count, nullptr), "listing the Vulkan devices");
  std::vector<VkPhysicalDevice> devices(count);
  check(vkEnumeratePhysicalDevices(instance.handle, &count, devices.data()), "listing the Vulkan devices");
  if (devices.empty()) throw GpuError("no Vulkan device: no driver is installed (for software, mesa-vulkan-drivers)");

  const char* wanted_name = std::getenv("LUMIGRAFT_VULKAN_DEVICE");
  std::string reasons;
  std::optional<VkPhysicalDevice> best;
  int best_rank = 0;
  for (const VkPhysicalDevice device : devices) {
    VkPhysicalDeviceProperties properties{};
    vkGetPhysicalDeviceProperties(device, &properties);
    std::vector<std::string> why_not = missing(device, properties);
    if (wanted_name && std::string_view(properties.deviceName).find(wanted_name) == std::string_view::npos) {
      why_not = {std::string("LUMIGRAFT_VULKAN_DEVICE asks for \"") + wanted_name + "\""};
    }
    if (why_not.empty()) {
      if (!best || rank(properties.deviceType) < best_rank) {
        best = device;
        best_rank = rank(properties.deviceType);
      }
      continue;
    }
    reasons += std::string("; ") + properties.deviceName + ": ";
    for (std::size_t i = 0; i < why_not.size(); ++i) reasons += (i ? ", " : "") + why_not[i];
  }
  if (!best) throw GpuError("no usable Vulkan device" + reasons);
  return {*best, *find_queue_family(*best)};
}

}  // namespace lumigraft::gpu::vulkan
