#include "relight/gpu/device.h"

#include <cstring>
#include <map>

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
    std::shared_ptr<ComputeObjects>& shared = compute_[std::string(shader)];
    if (!shared) shared = checked(std::make_shared<ComputeObjects>(context_, find_shader(shader, more_shaders_)));
    return std::make_unique<VulkanCompute>(shared);
  }
  std::unique_ptr<RasterPipeline> create_raster(const RasterDesc& desc) override {
    return checked(std::make_unique<VulkanRaster>(context_, desc, find_shader(desc.vertex_shader, more_shaders_),
                                                  find_shader(desc.fragment_shader, more_shaders_)));
  }

  void upload(const Texture& texture, int mip, std::span<const std::byte> texels) override {
    const VulkanTexture& target = own<VulkanTexture>(texture, *context_);
    check_upload(texture, mip, texels.size());
    std::memcpy(upload_to(target, mip), texels.data(), texels.size());
  }

  void upload_rgb(const Texture& texture, std::span<const std::uint8_t> rgb) override {
    const VulkanTexture& target = own<VulkanTexture>(texture, *context_);
    check_upload_rgb(texture, rgb.size());
    const TextureDesc& desc = texture.desc();
    const HostRows direct = target.host_rows();    // nothing runs meanwhile: submit() waits
    if (direct.first) context_->finish_uploads();  // one to the same texture would come after this one
    const HostRows rows =
        direct.first ? direct : HostRows{upload_to(target, 0), 4 * static_cast<std::size_t>(desc.width)};
    for (int v = 0; v < desc.height; ++v) {
      const auto row = static_cast<std::size_t>(v);
      expand_rgb(&rgb[3 * row * static_cast<std::size_t>(desc.width)], desc.width, rows.first + row * rows.pitch_bytes);
    }
  }

  void upload(const Buffer& buffer, std::size_t offset, std::span<const std::byte> bytes) override {
    const VulkanBuffer& target = own<VulkanBuffer>(buffer, *context_);
    check_upload(buffer, offset, bytes.size());
    if (bytes.empty()) return;
    if (target.mapped()) {  // no commands are in flight: submit() waits
      std::memcpy(target.mapped() + offset, bytes.data(), bytes.size());
      return;
    }
    const auto record = [&](VkCommandBuffer commands, VkBuffer from, VkDeviceSize at) {
      const VkBufferCopy copy{at, offset, bytes.size()};
      vkCmdCopyBuffer(commands, from, target.handle(), 1, &copy);
    };
    std::memcpy(context_->upload(bytes.size(), record), bytes.data(), bytes.size());
  }

  std::vector<std::byte> download(const Texture& texture, int mip) override {
    const VulkanTexture& source = own<VulkanTexture>(texture, *context_);
    const std::string what = mip_text(texture, mip);
    const std::size_t size = mip_bytes(texture.desc(), mip);
    const AllocatedBuffer& staging = context_->download_memory(size);
    context_->run_once("download of " + what, [&](VkCommandBuffer commands) {
      const VkBufferImageCopy copy = source.copy_of(mip);
      vkCmdCopyImageToBuffer(commands, source.image(), VK_IMAGE_LAYOUT_GENERAL, staging.handle, 1, &copy);
    });
    return {staging.memory.mapped, staging.memory.mapped + size};
  }

  std::vector<std::byte> download(const Buffer& buffer) override {
    const VulkanBuffer& source = own<VulkanBuffer>(buffer, *context_);
    const AllocatedBuffer& staging = context_->download_memory(buffer.size_bytes());
    context_->run_once("download of buffer \"" + source.name() + "\"", [&](VkCommandBuffer commands) {
      const VkBufferCopy copy{0, 0, buffer.size_bytes()};
      vkCmdCopyBuffer(commands, source.handle(), staging.handle, 1, &copy);
    });
    return {staging.memory.mapped, staging.memory.mapped + buffer.size_bytes()};
  }

  std::vector<std::vector<std::byte>> download(std::span<const TexturePart> parts) override {
    std::size_t size = 0;
    std::vector<VkBufferImageCopy> copies;
    for (const TexturePart& part : parts) {
      check_part(part);
      copies.push_back(own<VulkanTexture>(*part.texture, *context_).copy_of(part.area));
      copies.back().bufferOffset = size;
      size += (area_bytes(part.texture->desc(), part.area) + 15) / 16 * 16;
    }
    if (size == 0) return {};
    const AllocatedBuffer& staging = context_->download_memory(size);
    context_->run_once("download of parts of textures", [&](VkCommandBuffer commands) {
      for (std::size_t i = 0; i < parts.size(); ++i) {
        vkCmdCopyImageToBuffer(commands, own<VulkanTexture>(*parts[i].texture, *context_).image(),
                               VK_IMAGE_LAYOUT_GENERAL, staging.handle, 1, &copies[i]);
      }
    });
    std::vector<std::vector<std::byte>> texels;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const std::byte* first = staging.memory.mapped + copies[i].bufferOffset;
      texels.emplace_back(first, first + area_bytes(parts[i].texture->desc(), parts[i].area));
    }
    return texels;
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
  template <typename Pointer>
  Pointer checked(Pointer made) {
    context_->messages().throw_if_any();
    return made;
  }

  /// Memory to write the texels to.
  std::byte* upload_to(const VulkanTexture& target, int mip) {
    const auto record = [&](VkCommandBuffer commands, VkBuffer from, VkDeviceSize at) {
      VkBufferImageCopy copy = target.copy_of(mip);
      copy.bufferOffset = at;
      vkCmdCopyBufferToImage(commands, from, target.image(), VK_IMAGE_LAYOUT_GENERAL, 1, &copy);
    };
    return context_->upload(mip_bytes(target.desc(), mip), record);
  }

  std::shared_ptr<Context> context_;
  std::vector<ShaderCode> more_shaders_;
  std::map<std::string, std::shared_ptr<ComputeObjects>> compute_;  ///< by shader: compiling one takes long
  std::shared_ptr<const TextureClear> texture_clear_;
};

}  // namespace
}  // namespace vulkan

std::unique_ptr<Device> create_vulkan_device(const DeviceOptions& options) {
  auto instance = std::make_unique<vulkan::Instance>(options.validation);
  const vulkan::Choice choice = vulkan::choose_device(*instance);
  auto context = std::make_shared<vulkan::Context>(std::move(instance), choice, options.hangs_after);
  return std::make_unique<vulkan::VulkanDevice>(std::move(context), options.more_shaders);
}

}  // namespace lumigraft::relight::gpu
