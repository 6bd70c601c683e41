#include "relight/gpu/device.h"

#include <cstring>

#include "relight/gpu/check_commands.h"
#include "relight/gpu/formats.h"
#include "relight/gpu/vulkan/choose_device.h"
#include "relight/gpu/vulkan/command_list.h"

namespace lumigraft::relight::gpu {
namespace vulkan {
namespace {

/// One row.
void expand_rgb(const std::uint8_t* rgb, int pixels, std::byte* rgba) {
  for (int i = 0; i < pixels; ++i) {
    for (int c = 0; c < 3; ++c) rgba[4 * i + c] = std::byte{rgb[3 * i + c]};
    rgba[4 * i + 3] = std::byte{255};
  }
}

class VulkanDevice final : public Device {
 public:
  VulkanDevice(std::shared_ptr<Context> context, std::span<const ShaderCode> more_shaders)
      : context_(std::move(context)), more_shaders_(more_shaders.begin(), more_shaders.end()) {}

  std::string name() const override { return context_->name(); }
  bool is_software() const override { return context_->is_software(); }
  const Holdings& holdings() const override { return *context_->holdings(); }

  std::unique_ptr<Texture> create_texture(const TextureDesc& desc) override {
    return checked(std::make_unique<VulkanTexture>(context_, desc));
  }
  std::unique_ptr<Buffer> create_buffer(std::size_t size_bytes, std::string_view name) override {
    return checked(std::make_unique<VulkanBuffer>(context_, size_bytes, std::string(name)));
  }
  std::unique_ptr<ComputePipeline> create_compute(std::string_view shader) override {
    return checked(std::make_unique<VulkanCompute>(context_, find_shader(shader, more_shaders_)));
  }
  std::unique_ptr<RasterPipeline> create_raster(const RasterDesc& desc) override {
    return checked(std::make_unique<VulkanRaster>(context_, desc, find_shader(desc.vertex_shader, more_shaders_),
                                                  find_shader(desc.fragment_shader, more_shaders_)));
  }

  void upload(const Texture& texture, int mip, std::span<const std::byte> texels) override {
    const VulkanTexture& target = own<VulkanTexture>(texture, *context_);
    check_upload(texture, mip, texels.size());
    copy_staged(staged(texels), target, mip);
  }

  void upload_rgb(const Texture& texture, std::span<const std::uint8_t> rgb) override {
    const VulkanTexture& target = own<VulkanTexture>(texture, *context_);
    check_upload_rgb(texture, rgb.size());
    const TextureDesc& desc = texture.desc();
    const HostRows direct = target.host_rows();  // nothing runs meanwhile: submit() waits
    const AllocatedBuffer* staging =
        direct.first ? nullptr : &context_->staging(mip_bytes(desc, 0), MemoryUse::to_device);
    const HostRows rows =
        direct.first ? direct : HostRows{staging->memory.mapped, 4 * static_cast<std::size_t>(desc.width)};
    for (int v = 0; v < desc.height; ++v) {
      const auto row = static_cast<std::size_t>(v);
      expand_rgb(&rgb[3 * row * static_cast<std::size_t>(desc.width)], desc.width, rows.first + row * rows.pitch_bytes);
    }
    if (staging) copy_staged(*staging, target, 0);
  }

  void upload(const Buffer& buffer, std::size_t offset, std::span<const std::byte> bytes) override {
    const VulkanBuffer& target = own<VulkanBuffer>(buffer, *context_);
    check_upload(buffer, offset, bytes.size());
    if (bytes.empty()) return;
    if (target.mapped()) {  // no commands are in flight: submit() waits
      std::memcpy(target.mapped() + offset, bytes.data(), bytes.size());
      return;
    }
    const AllocatedBuffer& staging = staged(bytes);
    context_->run_once("upload to buffer \"" + target.name() + "\"", [&](VkCommandBuffer commands) {
      const VkBufferCopy copy{0, offset, bytes.size()};
      vkCmdCopyBuffer(commands, staging.handle, target.handle(), 1, &copy);
    });
  }

  std::vector<std::byte> download(const Texture& texture, int mip) override {
    const VulkanTexture& source = own<VulkanTexture>(texture, *context_);
    const std::string what = mip_text(texture, mip);
    const std::size_t size = mip_bytes(texture.desc(), mip);
    const AllocatedBuffer& staging = context_->staging(size, MemoryUse::from_device);
    context_->run_once("download of " + what, [&](VkCommandBuffer commands) {
      const VkBufferImageCopy copy = source.copy_of(mip);
      vkCmdCopyImageToBuffer(commands, source.image(), VK_IMAGE_LAYOUT_GENERAL, staging.handle, 1, &copy);
    });
    return {staging.memory.mapped, staging.memory.mapped + size};
  }

  std::vector<std::byte> download(const Buffer& buffer) override {
    const VulkanBuffer& source = own<VulkanBuffer>(buffer, *context_);
    const AllocatedBuffer& staging = context_->staging(buffer.size_bytes(), MemoryUse::from_device);
    context_->run_once("download of buffer \"" + source.name() + "\"", [&](VkCommandBuffer commands) {
      const VkBufferCopy copy{0, 0, buffer.size_bytes()};
      vkCmdCopyBuffer(commands, source.handle(), staging.handle, 1, &copy);
    });
    return {staging.memory.mapped, staging.memory.mapped + buffer.size_bytes()};
  }

  std::unique_ptr<CommandList> begin() override {
    if (!texture_clear_ && !context_->is_software()) texture_clear_ = std::make_shared<TextureClear>(*this);
    return std::make_unique<VulkanCommandList>(context_, texture_clear_);
  }

  std::vector<PassTime> submit(CommandList& list) override {
    return own_object<VulkanCommandList>(list, *context_, "a command list").run();
  }

 private:
  /// Validation messages about a new object are thrown to its creator.
  template <typename T>
  std::unique_ptr<T> checked(std::unique_ptr<T> made) {
    context_->messages().throw_if_any();
    return made;
  }

  void copy_staged(const AllocatedBuffer& staging, const VulkanTexture& target, int mip) {
    context_->run_once("upload to " + mip_text(target, mip), [&](VkCommandBuffer commands) {
      const VkBufferImageCopy copy = target.copy_of(mip);
      vkCmdCopyBufferToImage(commands, staging.handle, target.image(), VK_IMAGE_LAYOUT_GENERAL, 1, &copy);
    });
  }

  const AllocatedBuffer& staged(std::span<const std::byte> bytes) {
    const AllocatedBuffer& staging = context_->staging(bytes.size(), MemoryUse::to_device);
    std::memcpy(staging.memory.mapped, bytes.data(), bytes.size());
    return staging;
  }

  std::shared_ptr<Context> context_;
  std::vector<ShaderCode> more_shaders_;
  std::shared_ptr<const TextureClear> texture_clear_;
};

}  // namespace
}  // namespace vulkan

std::unique_ptr<Device> create_vulkan_device(const DeviceOptions& options) {
  auto instance = std::make_unique<vulkan::Instance>(options.validation);
  const vulkan::Choice choice = vulkan::choose_device(*instance);
  auto context = std::make_shared<vulkan::Context>(std::move(instance), choice);
  return std::make_unique<vulkan::VulkanDevice>(std::move(context), options.more_shaders);
}

}  // namespace lumigraft::relight::gpu
