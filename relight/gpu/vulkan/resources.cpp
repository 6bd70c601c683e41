#include "relight/gpu/vulkan/resources.h"

#include "relight/gpu/check_commands.h"
#include "relight/gpu/formats.h"
#include "relight/gpu/vulkan/choose_device.h"

namespace lumigraft::relight::gpu::vulkan {
namespace {

std::uint32_t edge(int value) { return static_cast<std::uint32_t>(value); }

VkImageUsageFlags usage_of(const TextureDesc& desc) {
  VkImageUsageFlags usage =
      VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  if (is_storable(desc.format)) usage |= VK_IMAGE_USAGE_STORAGE_BIT;
  if (desc.attachment) {
    usage |= is_depth(desc.format) ? VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT : VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  }
  return usage;
}

}  // namespace

VulkanTexture::VulkanTexture(std::shared_ptr<Context> context, const TextureDesc& desc)
    : Texture(desc, context->holdings()), context_(std::move(context)) {
  const VkPhysicalDeviceLimits& limits = context_->limits();
  check_texture_edge(desc_, is_volume(desc_) ? limits.maxImageDimension3D : limits.maxImageDimension2D,
                     context_->name());
  try {
    create_image();
    first_mip_ = create_view(1);
    all_mips_ = create_view(desc_.mips);
    clear_new();
  } catch (...) {
    destroy();
    throw;
  }
}

void VulkanTexture::create_image() {
  const std::string what = text_of(desc_);
  auto info = zeroed<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = is_volume(desc_) ? VK_IMAGE_TYPE_3D : VK_IMAGE_TYPE_2D;
  info.format = vk_format(desc_.format);
  info.extent = {edge(desc_.width), edge(desc_.height), edge(desc_.depth)};
  info.mipLevels = edge(desc_.mips);
  info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.usage = usage_of(desc_);
  linear_ = desc_.host_written && context_->host_writes_textures(info.format, info.usage, info.extent);
  info.tiling = linear_ ? VK_IMAGE_TILING_LINEAR : VK_IMAGE_TILING_OPTIMAL;
  check(vkCreateImage(context_->device(), &info, nullptr, &image_), "creating " + what);
  VkMemoryRequirements needs{};
  vkGetImageMemoryRequirements(context_->device(), image_, &needs);
  memory_ = context_->allocate(needs, MemoryUse::device, what);
  check(vkBindImageMemory(context_->device(), image_, memory_.handle, 0), "binding " + what);
  context_->set_name(VK_OBJECT_TYPE_IMAGE, reinterpret_cast<std::uint64_t>(image_), desc_.name);
}

VkImageView VulkanTexture::create_view(int mips) const {
  auto info = zeroed<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
  info.image = image_;
  info.viewType = is_volume(desc_) ? VK_IMAGE_VIEW_TYPE_3D : VK_IMAGE_VIEW_TYPE_2D;
  info.format = vk_format(desc_.format);
  info.subresourceRange = {aspect(), 0, edge(mips), 0, 1};
  VkImageView view = VK_NULL_HANDLE;
  check(vkCreateImageView(context_->device(), &info, nullptr, &view), "viewing texture \"" + desc_.name + "\"");
  return view;
}

void VulkanTexture::clear_new() {
  context_->run_once("clearing texture \"" + desc_.name + "\"", [&](VkCommandBuffer commands) {
    auto barrier = zeroed<VkImageMemoryBarrier2>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2);
    barrier.srcStageMask = VK_PIPELINE_STAGE_2_NONE;
    barrier.dstStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    barrier.dstAccessMask = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT;
    barrier.oldLayout = VK_IMAGE_LAYOUT_UNDEFINED;
    barrier.newLayout = VK_IMAGE_LAYOUT_GENERAL;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image_;
    barrier.subresourceRange = {aspect(), 0, VK_REMAINING_MIP_LEVELS, 0, 1};
    auto dependency = zeroed<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
    dependency.imageMemoryBarrierCount = 1;
    dependency.pImageMemoryBarriers = &barrier;
    vkCmdPipelineBarrier2(commands, &dependency);
    clear_all_mips(commands, *this, {});
  });
}

void VulkanTexture::destroy() {
  if (context_->hung()) return;
  context_->finish_uploads(std::nothrow);
  if (context_->hung()) return;
  for (const VkImageView view : {first_mip_, all_mips_}) vkDestroyImageView(context_->device(), view, nullptr);
  vkDestroyImage(context_->device(), image_, nullptr);
  vkFreeMemory(context_->device(), memory_.handle, nullptr);
}

VkImageAspectFlags VulkanTexture::aspect() const {
  return is_depth(desc_.format) ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT;
}

VkBufferImageCopy VulkanTexture::copy_of(int mip) const {
  VkBufferImageCopy copy{};
  copy.imageSubresource = {aspect(), edge(mip), 0, 1};
  copy.imageExtent = {edge(mip_edge(desc_.width, mip)), edge(mip_edge(desc_.height, mip)),
                      edge(mip_edge(desc_.depth, mip))};
  return copy;
}

VkBufferImageCopy VulkanTexture::copy_of(const Area& area) const {
  VkBufferImageCopy copy = copy_of(0);
  copy.imageOffset = {area.x, area.y, 0};
  copy.imageExtent = {edge(area.width), edge(area.height), 1};
  return copy;
}

HostRows VulkanTexture::host_rows() const {
  if (!linear_ || !memory_.mapped) return {};
  const VkImageSubresource first{aspect(), 0, 0};
  VkSubresourceLayout layout{};
  vkGetImageSubresourceLayout(context_->device(), image_, &first, &layout);
  return {memory_.mapped + layout.offset, layout.rowPitch};
}

VulkanBuffer::VulkanBuffer(std::shared_ptr<Context> context, std::size_t size_bytes, const std::string& name)
    : Buffer(size_bytes, name, context->holdings()), context_(std::move(context)) {
  check_buffer_bytes(*this, context_->limits().maxStorageBufferRange, context_->name());
  const std::string what = "buffer \"" + name_ + "\"";
  try {
    buffer_ = context_->create_buffer((size_bytes_ + 3) / 4 * 4,  // fills and shaders access whole words
                                      VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_VERTEX_BUFFER_BIT |
                                          VK_BUFFER_USAGE_INDEX_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                                          VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                      MemoryUse::device, what);
    context_->set_name(VK_OBJECT_TYPE_BUFFER, reinterpret_cast<std::uint64_t>(handle()), name_);
    context_->run_once("clearing " + what,
                       [&](VkCommandBuffer commands) { vkCmdFillBuffer(commands, handle(), 0, VK_WHOLE_SIZE, 0); });
  } catch (...) {
    context_->destroy(buffer_);
    throw;
  }
}

void clear_all_mips(VkCommandBuffer commands, const VulkanTexture& texture, const std::array<float, 4>& value) {
  const VkImageSubresourceRange range{texture.aspect(), 0, VK_REMAINING_MIP_LEVELS, 0, 1};
  if (is_depth(texture.desc().format)) {
    const VkClearDepthStencilValue depth{value[0], 0};
    vkCmdClearDepthStencilImage(commands, texture.image(), VK_IMAGE_LAYOUT_GENERAL, &depth, 1, &range);
  } else {
    VkClearColorValue color;
    std::copy(value.begin(), value.end(), color.float32);
    vkCmdClearColorImage(commands, texture.image(), VK_IMAGE_LAYOUT_GENERAL, &color, 1, &range);
  }
}

}  // namespace lumigraft::relight::gpu::vulkan
