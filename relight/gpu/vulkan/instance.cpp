#include <algorithm>
#include <cstring>
#include <map>

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
  const std::map<VkResult, std::string> texts{
      {VK_ERROR_OUT_OF_HOST_MEMORY, "out of host memory"},
      {VK_ERROR_OUT_OF_DEVICE_MEMORY, "out of device memory"},
      {VK_ERROR_DEVICE_LOST, "the device was lost (it hung, crashed or was removed)"},
      {VK_ERROR_TOO_MANY_OBJECTS, "too many allocations"},
      {VK_ERROR_INITIALIZATION_FAILED, "the driver could not start"},
      {VK_ERROR_FORMAT_NOT_SUPPORTED, "the driver does not support the format"},
  };
  const auto text = texts.find(result);
  return text == texts.end() ? "Vulkan error " + std::to_string(result) : text->second;
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
  auto application = zeroed<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
  application.pApplicationName = "lumigraft";
  application.apiVersion = VK_API_VERSION_1_3;
  auto listen = zeroed<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
  listen.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  listen.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  listen.pfnUserCallback = on_message;
  listen.pUserData = &messages;
  // Also detects hazards between commands (a missing barrier), which software devices hide.
  const VkValidationFeatureEnableEXT synchronization = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  auto more = zeroed<VkValidationFeaturesEXT>(VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT);
  more.pNext = &listen;
  more.enabledValidationFeatureCount = 1;
  more.pEnabledValidationFeatures = &synchronization;
  const char* const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  auto info = zeroed<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
  info.pApplicationInfo = &application;
  if (validation) {
    info.pNext = &more;
    info.enabledLayerCount = info.enabledExtensionCount = 1;
    info.ppEnabledLayerNames = &validation_layer;
    info.ppEnabledExtensionNames = &extension;
  }
  const VkResult result = vkCreateInstance(&info, nullptr, &handle);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER) throw GpuError(no_driver_text());
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
