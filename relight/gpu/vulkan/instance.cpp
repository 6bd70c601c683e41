#include <algorithm>
#include <cstring>

#include "relight/gpu/backends.h"
#include "relight/gpu/vulkan/context.h"

namespace lumigraft::relight::gpu::vulkan {
namespace {

constexpr const char* validation_layer = "VK_LAYER_KHRONOS_validation";

bool has_validation_layer() {
  std::uint32_t count = 0;
  check(vkEnumerateInstanceLayerProperties(&count, nullptr), "listing the Vulkan layers");
  std::vector<VkLayerProperties> layers(count);
  check(vkEnumerateInstanceLayerProperties(&count, layers.data()), "listing the Vulkan layers");
  return std::any_of(layers.begin(), layers.end(),
                     [](const auto& layer) { return std::strcmp(layer.layerName, validation_layer) == 0; });
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* messages) {
  static_cast<Messages*>(messages)->add(data->pMessage);
  return VK_FALSE;
}

std::string text_of(VkResult result) {
  switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "out of host memory";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "out of device memory";
    case VK_ERROR_DEVICE_LOST:
      return "the device was lost (it hung, crashed or was removed)";
    case VK_ERROR_TOO_MANY_OBJECTS:
      return "too many allocations";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "the driver could not start";
    case VK_ERROR_FORMAT_NOT_SUPPORTED:
      return "the driver does not support the format";
    default:
      return "Vulkan error " + std::to_string(result);
  }
}

}  // namespace

std::string no_driver_text() {
  return "no Vulkan device: no driver is installed (for software, mesa-vulkan-drivers)" +
         settings_text({"VK_DRIVER_FILES", "VK_ICD_FILENAMES"});
}

void check(VkResult result, const std::string& doing) {
  if (result == VK_ERROR_DEVICE_LOST) throw DeviceLost(doing + ": " + text_of(result));
  if (result != VK_SUCCESS) throw GpuError(doing + ": " + text_of(result));
}

Instance::Instance(bool with_validation) : validation(with_validation) {
  if (validation && !has_validation_layer()) {
    throw GpuError("the Vulkan validation layer is not installed (Debian: vulkan-validationlayers)");
  }
  const VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                      .pNext = nullptr,
                                      .pApplicationName = "lumigraft",
                                      .applicationVersion = 0,
                                      .pEngineName = nullptr,
                                      .engineVersion = 0,
                                      .apiVersion = VK_API_VERSION_1_3};
  const VkDebugUtilsMessengerCreateInfoEXT listen{.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
                                                  .pNext = nullptr,
                                                  .flags = 0,
                                                  .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                                                                     VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
                                                  .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT,
                                                  .pfnUserCallback = on_message,
                                                  .pUserData = &messages};
  // Also detects hazards between commands (a missing barrier), which software devices hide.
  const VkValidationFeatureEnableEXT synchronization = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  const VkValidationFeaturesEXT more{.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                                     .pNext = &listen,
                                     .enabledValidationFeatureCount = 1,
                                     .pEnabledValidationFeatures = &synchronization,
                                     .disabledValidationFeatureCount = 0,
                                     .pDisabledValidationFeatures = nullptr};
  const char* const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  const VkInstanceCreateInfo info{.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                  .pNext = validation ? &more : nullptr,
                                  .flags = 0,
                                  .pApplicationInfo = &application,
                                  .enabledLayerCount = validation ? 1u : 0u,
                                  .ppEnabledLayerNames = &validation_layer,
                                  .enabledExtensionCount = validation ? 1u : 0u,
                                  .ppEnabledExtensionNames = &extension};
  const VkResult result = vkCreateInstance(&info, nullptr, &handle);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER) {
    throw GpuError(no_driver_text());
  }
  check(result, "starting Vulkan");
  if (!validation) return;
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(handle, "vkCreateDebugUtilsMessengerEXT"));
  const VkResult listening = create(handle, &listen, nullptr, &messenger);
  if (listening != VK_SUCCESS) vkDestroyInstance(handle, nullptr);
  check(listening, "listening to the Vulkan validation layer");
}

Instance::~Instance() {
  if (messenger) {
    const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(handle, "vkDestroyDebugUtilsMessengerEXT"));
    destroy(handle, messenger, nullptr);
  }
  vkDestroyInstance(handle, nullptr);
}

}  // namespace lumigraft::relight::gpu::vulkan
