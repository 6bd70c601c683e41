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
  VkImageView first_mip() const { return first_mip_; }  ///< for storage and attachments
  VkImageView all_mips() const { return all_mips_; }    ///< for sampling
  VkImageAspectFlags aspect() const;
  VkBufferImageCopy copy_of(int mip) const;
  VkBufferImageCopy copy_of(const Area& area) const;
  HostRows host_rows() const;

 private:
  void create_image();
  VkImageView create_view(int mips) const;
  void clear_new();
  void destroy();

  std::shared_ptr<Context> context_;
  VkImage image_ = VK_NULL_HANDLE;
  Memory memory_;
  bool linear_ = false;
  VkImageView first_mip_ = VK_NULL_HANDLE, all_mips_ = VK_NULL_HANDLE;
};

class VulkanBuffer final : public Buffer {
 public:
  VulkanBuffer(std::shared_ptr<Context> context, std::size_t size_bytes, const std::string& name);
  ~VulkanBuffer() override {
    context_->finish_uploads(std::nothrow);
    context_->destroy(buffer_);
  }

  const Context* context() const { return context_.get(); }
  VkBuffer handle() const { return buffer_.handle; }
  std::byte* mapped() const { return buffer_.memory.mapped; }  ///< null: only the device can write it

 private:
  std::shared_ptr<Context> context_;
  AllocatedBuffer buffer_;
};

void clear_all_mips(VkCommandBuffer commands, const VulkanTexture& texture, const std::array<float, 4>& value);

}  // namespace lumigraft::relight::gpu::vulkan
