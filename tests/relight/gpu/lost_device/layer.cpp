// A Vulkan layer that simulates lost devices, since software devices are never lost: after lose_all_devices(), all work
// on existing devices returns VK_ERROR_DEVICE_LOST, as from a driver that reset its GPU; after hang_all_devices(),
// waits for it time out, as while a GPU hangs. Devices created later work.
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <cstring>
#include <map>
#include <mutex>

namespace {

struct Device {
  PFN_vkGetDeviceProcAddr get = nullptr;
  PFN_vkQueueSubmit2 submit = nullptr;
  PFN_vkWaitForFences wait = nullptr;
  PFN_vkDestroyDevice destroy = nullptr;
  bool lost = false, hangs = false;
};

std::mutex mutex;
std::map<void*, PFN_vkGetInstanceProcAddr> instances;
std::map<void*, Device> devices;

/// The loader's dispatch table, of an instance and its physical devices or of a device and its queues.
template <typename Handle>
void* key_of(Handle handle) {
  return *reinterpret_cast<void**>(handle);
}

template <typename Handle>
Device device_of(Handle handle) {
  const std::lock_guard lock(mutex);
  return devices.at(key_of(handle));
}

/// The link information for this layer that the loader put into the chain of structures.
template <typename Info>
Info* link_in(const void* chain, VkStructureType type) {
  for (auto* info = static_cast<Info*>(const_cast<void*>(chain)); info;
       info = static_cast<Info*>(const_cast<void*>(info->pNext))) {
    if (info->sType == type && info->function == VK_LAYER_LINK_INFO) return info;
  }
  return nullptr;
}

VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info, const VkAllocationCallbacks* allocator,
                                               VkInstance* instance) {
  auto* link = link_in<VkLayerInstanceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
  if (!link) return VK_ERROR_INITIALIZATION_FAILED;
  const PFN_vkGetInstanceProcAddr get = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const auto create = reinterpret_cast<PFN_vkCreateInstance>(get(VK_NULL_HANDLE, "vkCreateInstance"));
  const VkResult result = create(info, allocator, instance);
  if (result != VK_SUCCESS) return result;
  const std::lock_guard lock(mutex);
  instances[key_of(*instance)] = get;
  return VK_SUCCESS;
}

VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                             const VkAllocationCallbacks* allocator, VkDevice* device) {
  auto* link = link_in<VkLayerDeviceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
  if (!link) return VK_ERROR_INITIALIZATION_FAILED;
  const PFN_vkGetInstanceProcAddr instance_get = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
  const PFN_vkGetDeviceProcAddr get = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const auto create = reinterpret_cast<PFN_vkCreateDevice>(instance_get(VK_NULL_HANDLE, "vkCreateDevice"));
  const VkResult result = create(physical, info, allocator, device);
  if (result != VK_SUCCESS) return result;
  const std::lock_guard lock(mutex);
  devices[key_of(*device)] = {.get = get,
                              .submit = reinterpret_cast<PFN_vkQueueSubmit2>(get(*device, "vkQueueSubmit2")),
                              .wait = reinterpret_cast<PFN_vkWaitForFences>(get(*device, "vkWaitForFences")),
                              .destroy = reinterpret_cast<PFN_vkDestroyDevice>(get(*device, "vkDestroyDevice"))};
  return VK_SUCCESS;
}

VKAPI_ATTR void VKAPI_CALL destroy_device(VkDevice device, const VkAllocationCallbacks* allocator) {
  if (!device) return;
  void* const key = key_of(device);
  device_of(device).destroy(device, allocator);
  const std::lock_guard lock(mutex);
  devices.erase(key);
}

VKAPI_ATTR VkResult VKAPI_CALL queue_submit(VkQueue queue, std::uint32_t count, const VkSubmitInfo2* submits,
                                            VkFence fence) {
  const Device device = device_of(queue);
  return device.lost ? VK_ERROR_DEVICE_LOST : device.submit(queue, count, submits, fence);
}

VKAPI_ATTR VkResult VKAPI_CALL wait_for_fences(VkDevice handle, std::uint32_t count, const VkFence* fences,
                                               VkBool32 all, std::uint64_t timeout_ns) {
  const Device device = device_of(handle);
  if (device.hangs) return VK_TIMEOUT;  // at once: whoever waits counts slices, not time
  return device.lost ? VK_ERROR_DEVICE_LOST : device.wait(handle, count, fences, all, timeout_ns);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_device_proc(VkDevice device, const char* name) {
  const auto is = [name](const char* other) { return std::strcmp(name, other) == 0; };
  if (is("vkGetDeviceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(get_device_proc);
  if (is("vkDestroyDevice")) return reinterpret_cast<PFN_vkVoidFunction>(destroy_device);
  if (is("vkQueueSubmit2")) return reinterpret_cast<PFN_vkVoidFunction>(queue_submit);
  if (is("vkWaitForFences")) return reinterpret_cast<PFN_vkVoidFunction>(wait_for_fences);
  return device_of(device).get(device, name);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_instance_proc(VkInstance instance, const char* name) {
  const auto is = [name](const char* other) { return std::strcmp(name, other) == 0; };
  if (is("vkGetInstanceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(get_instance_proc);
  if (is("vkCreateInstance")) return reinterpret_cast<PFN_vkVoidFunction>(create_instance);
  if (is("vkCreateDevice")) return reinterpret_cast<PFN_vkVoidFunction>(create_device);
  if (is("vkGetDeviceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(get_device_proc);
  if (!instance) return nullptr;
  PFN_vkGetInstanceProcAddr next = nullptr;
  {
    const std::lock_guard lock(mutex);
    next = instances.at(key_of(instance));
  }
  return next(instance, name);
}

}  // namespace

extern "C" {

VK_LAYER_EXPORT VKAPI_ATTR VkResult VKAPI_CALL
vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* interface) {
  interface->loaderLayerInterfaceVersion = 2;
  interface->pfnGetInstanceProcAddr = get_instance_proc;
  interface->pfnGetDeviceProcAddr = get_device_proc;
  interface->pfnGetPhysicalDeviceProcAddr = nullptr;
  return VK_SUCCESS;
}

VK_LAYER_EXPORT void lose_all_devices() {
  const std::lock_guard lock(mutex);
  for (auto& [key, device] : devices) device.lost = true;
}

VK_LAYER_EXPORT void hang_all_devices() {
  const std::lock_guard lock(mutex);
  for (auto& [key, device] : devices) device.hangs = true;
}

}  // extern "C"
