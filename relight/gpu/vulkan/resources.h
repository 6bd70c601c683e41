#pragma once
// Textures and buffers. Every image stays in VK_IMAGE_LAYOUT_GENERAL after its creation: a memory barrier suffices
// between any two uses.
#include "relight/gpu/vulkan/context.h"

namespace lumigraft::relight::gpu::vulkan {

/// A texture's texels in memory that the host can write.
struct HostRows {
  std::byte* first = nullptr;  ///< null where it cannot
  std::size_t pitch_bytes = 0;
};

class VulkanTexture final : public Texture {
 public:
  VulkanTexture(std::shared_ptr<Context> context, const TextureDesc& desc);
  ~VulkanTexture() override { destroy(); }

  const Context* context() const { return context_.get(); }
  VkImage image() const { return image_; }
  VkImageView mip_view(int mip) const { return mip_views_[static_cast<std::size_t>(mip)]; }
  VkImageView view_from(int mip) const { return views_from_[static_cast<std::size_t>(mip)]; }
  VkImageAspectFlags aspect() const;
  VkBufferImageCopy copy_of(int mip) const;
  HostRows host_rows() const;

 private:
  void create_image();
  void create_views();
  void clear_new();
  void destroy();

  std::shared_ptr<Context> context_;
  VkImage image_ = VK_NULL_HANDLE;
  Memory memory_;
  bool linear_ = false;
  std::vector<VkImageView> mip_views_;   ///< one level each: storage, attachments
  std::vector<VkImageView> views_from_;  ///< from one level to the last: sampling
};

class VulkanBuffer final : public Buffer {
 public:
  VulkanBuffer(std::shared_ptr<Context> context, std::size_t size_bytes, const std::string& name);
  ~VulkanBuffer() override { context_->destroy(buffer_); }

  const Context* context() const { return context_.get(); }
  VkBuffer handle() const { return buffer_.handle; }
  std::byte* mapped() const { return buffer_.memory.mapped; }  ///< null: only the device can write it

 private:
  std::shared_ptr<Context> context_;
  AllocatedBuffer buffer_;
};

/// The Vulkan object of a caller's resource. Throws std::logic_error if it belongs to another device.
const VulkanTexture& own(const Texture& texture, const Context& context);
const VulkanBuffer& own(const Buffer& buffer, const Context& context);

/// A colour for `format`; integers are rounded down and clamped.
VkClearColorValue clear_value(Format format, const std::array<float, 4>& value);
void clear_all_mips(VkCommandBuffer commands, const VulkanTexture& texture, const std::array<float, 4>& value);

}  // namespace lumigraft::relight::gpu::vulkan
