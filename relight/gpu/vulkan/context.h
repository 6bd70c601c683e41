#pragma once
// The Vulkan device and the state shared by everything created from it. Textures, buffers, pipelines and lists hold it
// by shared_ptr, so it is destroyed last.
#include <vulkan/vulkan.h>

#include <array>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "relight/gpu/device.h"
#include "relight/gpu/messages.h"

namespace lumigraft::relight::gpu::vulkan {

/// Throws GpuError or DeviceLost with the name of `result` unless it is VK_SUCCESS.
void check(VkResult result, const std::string& doing);

std::string no_driver_text();

/// A structure with all members zero but its type.
template <typename Info>
Info zeroed(VkStructureType type) {
  Info info{};
  info.sType = type;
  return info;
}

/// A Vulkan instance, with the validation layer on request.
struct Instance {
  explicit Instance(bool validation);
  ~Instance();

  Messages messages{"Vulkan validation"};
  bool validation;
  VkInstance handle = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;
};

/// A device to open, and its queue for drawing, compute and timestamps.
struct Choice {
  VkPhysicalDevice physical;
  std::uint32_t queue_family, timestamp_bits;
};

struct Memory {
  VkDeviceMemory handle = VK_NULL_HANDLE;
  std::byte* mapped = nullptr;  ///< null unless host visible
};
enum class MemoryUse { device, to_device, from_device };

/// A buffer with its own memory.
struct AllocatedBuffer {
  VkBuffer handle = VK_NULL_HANDLE;
  Memory memory;
  std::size_t size_bytes = 0;
};

class PendingUploads;
struct Recording;

class Context {
 public:
  Context(std::unique_ptr<Instance> instance, const Choice& choice,
          std::optional<std::chrono::milliseconds> hangs_after);
  ~Context();

  VkDevice device() const { return device_; }
  std::uint32_t queue_family() const { return queue_family_; }
  const VkPhysicalDeviceLimits& limits() const { return properties_.limits; }
  std::string name() const { return properties_.deviceName; }
  bool is_software() const { return properties_.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU; }
  std::uint32_t timestamp_bits() const { return timestamp_bits_; }
  VkSampler sampler(const Sampling& sampling) const { return samplers_[sampling.index()]; }
  Messages& messages() { return instance_->messages; }
  const std::shared_ptr<Holdings>& holdings() const { return holdings_; }
  /// Its work did not end: nothing of it is to be destroyed or reused.
  bool hung() const { return hung_; }
  void throw_if_hung() const;

  /// One allocation per resource: there are a few hundred, and every device allows at least 4096.
  Memory allocate(const VkMemoryRequirements& needs, MemoryUse use, const std::string& what);
  /// Whether 2D textures with rows in order may be made of memory that is the device's own and the host can write.
  bool host_writes_textures(VkFormat format, VkImageUsageFlags usage, const VkExtent3D& extent) const;
  AllocatedBuffer create_buffer(std::size_t size_bytes, VkBufferUsageFlags usage, MemoryUse use,
                                const std::string& what = "a host buffer");
  void destroy(AllocatedBuffer& buffer);
  /// Memory of at least that size for a download, reused for the next one.
  const AllocatedBuffer& download_memory(std::size_t size_bytes);

  /// Host memory to write `bytes` to before the next submission, which begins with the copies that `record(commands,
  /// buffer, offset)` records from there.
  std::byte* upload(std::size_t bytes, const std::function<void(VkCommandBuffer, VkBuffer, VkDeviceSize)>& record);
  /// Submits what was uploaded.
  void finish_uploads();
  /// The same before a resource is destroyed that may be a target: a failure makes it no less destroyed.
  void finish_uploads(std::nothrow_t) noexcept;
  /// After what was uploaded.
  void run_and_wait(VkCommandBuffer commands, const std::string& doing);
  void run_once(const std::string& doing, const std::function<void(VkCommandBuffer)>& record);
  void set_name(VkObjectType type, std::uint64_t handle, const std::string& name);

  /// Recordings of destroyed command lists, for reuse.
  std::vector<std::unique_ptr<Recording>> spare_recordings;

 private:
  Context(std::unique_ptr<Instance> instance, VkPhysicalDevice physical);
  void create_device();
  void create_samplers();

  std::shared_ptr<Holdings> holdings_ = std::make_shared<Holdings>();
  std::unique_ptr<Instance> instance_;
  VkPhysicalDevice physical_;
  std::uint32_t queue_family_ = 0;
  VkPhysicalDeviceProperties properties_{};
  VkPhysicalDeviceMemoryProperties memory_properties_{};
  std::uint32_t timestamp_bits_ = 0;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
  std::chrono::milliseconds hangs_after_{0};
  bool hung_ = false;
  VkCommandPool once_pool_ = VK_NULL_HANDLE;
  std::array<VkSampler, Sampling::kCount> samplers_{};
  AllocatedBuffer from_device_;
  std::unique_ptr<PendingUploads> uploads_;
  PFN_vkSetDebugUtilsObjectNameEXT set_name_ = nullptr;
};

VkResult allocate_commands(VkDevice device, VkCommandPool pool, VkCommandBuffer* commands);
void begin_once(VkCommandBuffer commands, const std::string& doing);

/// Makes all previous writes visible to later commands, or also to the host.
void full_barrier(VkCommandBuffer commands, bool to_host = false);

}  // namespace lumigraft::relight::gpu::vulkan
