#include "relight/gpu/vulkan/command_list.h"

#include "relight/gpu/check_commands.h"
#include "relight/gpu/formats.h"

namespace lumigraft::relight::gpu::vulkan {
namespace {

VkRenderingAttachmentInfo attachment_info(const Texture& texture, const Context& context) {
  auto info = zeroed<VkRenderingAttachmentInfo>(VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO);
  info.imageView = own<VulkanTexture>(texture, context).first_mip();
  info.imageLayout = VK_IMAGE_LAYOUT_GENERAL;
  info.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
  info.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  if (is_depth(texture.desc().format)) info.clearValue.depthStencil.depth = 1.0f;
  return info;
}

}  // namespace

VulkanCommandList::VulkanCommandList(std::shared_ptr<Context> context,
                                     std::shared_ptr<const TextureClear> texture_clear)
    : context_(std::move(context)), texture_clear_(std::move(texture_clear)), recording_(context_) {}

void VulkanCommandList::begin_command() {
  if (submitted_) throw std::logic_error("a command list that was submitted records nothing more");
  full_barrier(recording_->commands);
}

void VulkanCommandList::begin_pass(std::string_view name) {
  begin_command();
  passes_.emplace_back(name);
  recording_->write_timestamp();
}

VkDescriptorSet VulkanCommandList::bind(const PipelineObjects& pipeline, std::span<const Binding> bindings,
                                        std::span<const std::byte> params) {
  check_bindings(pipeline.name, pipeline.interface, bindings, params);
  std::vector<VkDescriptorBufferInfo> buffers(bindings.size() + 1);
  std::vector<VkDescriptorImageInfo> images(bindings.size());
  std::vector<VkWriteDescriptorSet> writes;
  const VkDescriptorSet set = recording_->allocate_set(pipeline.set_layout);
  const auto write = [&](int slot, VkDescriptorType type) -> VkWriteDescriptorSet& {
    VkWriteDescriptorSet& one = writes.emplace_back();
    one.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    one.dstSet = set;
    one.dstBinding = static_cast<std::uint32_t>(slot);
    one.descriptorCount = 1;
    one.descriptorType = type;
    return one;
  };

  if (pipeline.interface.params_used) {
    buffers.back() = recording_->copy_params(params, (params.size() + 15) / 16 * 16);
    write(0, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER).pBufferInfo = &buffers.back();
  }
  for (std::size_t i = 0; i < bindings.size(); ++i) {
    const Binding& binding = bindings[i];
    if (!pipeline.interface.slots.at(binding.slot).used) continue;  // not in the layout
    VkWriteDescriptorSet& one = write(binding.slot, descriptor_type(binding.kind));
    if (binding.kind == Binding::Kind::storage_buffer) {
      buffers[i] = {own<VulkanBuffer>(*binding.buffer, *context_).handle(), 0, VK_WHOLE_SIZE};
      one.pBufferInfo = &buffers[i];
      continue;
    }
    const VulkanTexture& texture = own<VulkanTexture>(*binding.texture, *context_);
    const bool is_sampled = binding.kind == Binding::Kind::sampled;
    images[i] = {is_sampled ? context_->sampler(binding.sampling) : VK_NULL_HANDLE,
                 is_sampled ? texture.all_mips() : texture.first_mip(), VK_IMAGE_LAYOUT_GENERAL};
    one.pImageInfo = &images[i];
  }
  vkUpdateDescriptorSets(context_->device(), static_cast<std::uint32_t>(writes.size()), writes.data(), 0, nullptr);
  return set;
}

void VulkanCommandList::dispatch(const ComputePipeline& pipeline, std::span<const Binding> bindings,
                                 std::span<const std::byte> params, int groups_x, int groups_y, int groups_z) {
  begin_command();
  const PipelineObjects& objects = own_object<const VulkanCompute>(pipeline, *context_, "a pipeline").objects();
  const std::uint32_t* max_groups = context_->limits().maxComputeWorkGroupCount;
  check_groups(objects.name, {groups_x, groups_y, groups_z}, {max_groups[0], max_groups[1], max_groups[2]});
  const VkDescriptorSet set = bind(objects, bindings, params);
  if (groups_x == 0 || groups_y == 0 || groups_z == 0) return;
  vkCmdBindPipeline(recording_->commands, VK_PIPELINE_BIND_POINT_COMPUTE, objects.handle);
  vkCmdBindDescriptorSets(recording_->commands, VK_PIPELINE_BIND_POINT_COMPUTE, objects.layout, 0, 1, &set, 0, nullptr);
  vkCmdDispatch(recording_->commands, static_cast<std::uint32_t>(groups_x), static_cast<std::uint32_t>(groups_y),
                static_cast<std::uint32_t>(groups_z));
}

void VulkanCommandList::draw(const RasterPipeline& pipeline, const std::vector<const Texture*>& colors,
                             const Texture& depth, std::span<const DrawCall> calls, const Area* area) {
  begin_command();
  const VulkanRaster& raster = own_object<const VulkanRaster>(pipeline, *context_, "a pipeline");
  check_draw(raster.objects().name, raster.desc(), colors, depth, calls, area);

  std::vector<VkDescriptorSet> sets;
  for (const DrawCall& call : calls) sets.push_back(bind(raster.objects(), call.bindings, call.params));
  std::vector<VkRenderingAttachmentInfo> color_infos;
  for (const Texture* color : colors) color_infos.push_back(attachment_info(*color, *context_));
  const VkRenderingAttachmentInfo depth_info = attachment_info(depth, *context_);

  const TextureDesc& target = depth.desc();
  auto rendering = zeroed<VkRenderingInfo>(VK_STRUCTURE_TYPE_RENDERING_INFO);
  const Area full{0, 0, target.width, target.height}, part = area ? *area : full;
  rendering.renderArea = {{part.x, part.y},
                          {static_cast<std::uint32_t>(part.width), static_cast<std::uint32_t>(part.height)}};
  rendering.layerCount = 1;
  rendering.colorAttachmentCount = static_cast<std::uint32_t>(color_infos.size());
  rendering.pColorAttachments = color_infos.data();
  rendering.pDepthAttachment = &depth_info;

  const VkCommandBuffer commands = recording_->commands;
  vkCmdBeginRendering(commands, &rendering);
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, raster.objects().handle);
  const VkViewport viewport{0, 0, static_cast<float>(target.width), static_cast<float>(target.height), 0, 1};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  vkCmdSetScissor(commands, 0, 1, &rendering.renderArea);
  for (std::size_t i = 0; i < calls.size(); ++i) draw_one(raster, calls[i], sets[i]);
  vkCmdEndRendering(commands);
}

void VulkanCommandList::draw_one(const VulkanRaster& pipeline, const DrawCall& call, VkDescriptorSet set) {
  if (call.index_count == 0) return;
  const VkCommandBuffer commands = recording_->commands;
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.objects().layout, 0, 1, &set, 0, nullptr);
  const VkBuffer vertices = own<VulkanBuffer>(*call.vertices, *context_).handle();
  const VkDeviceSize offset = 0;
  vkCmdBindVertexBuffers(commands, 0, 1, &vertices, &offset);
  vkCmdBindIndexBuffer(commands, own<VulkanBuffer>(*call.indices, *context_).handle(), 0, VK_INDEX_TYPE_UINT32);
  vkCmdDrawIndexed(commands, call.index_count, 1, 0, 0, 0);
}

void VulkanCommandList::fill(const Buffer& buffer, std::uint32_t value) {
  begin_command();
  vkCmdFillBuffer(recording_->commands, own<VulkanBuffer>(buffer, *context_).handle(), 0, VK_WHOLE_SIZE, value);
}

void VulkanCommandList::clear(const Texture& texture, std::array<float, 4> value) {
  if (texture_clear_ && texture_clear_->record(*this, texture, value)) return;
  begin_command();
  clear_all_mips(recording_->commands, own<VulkanTexture>(texture, *context_), value);
}

std::vector<PassTime> VulkanCommandList::run() {
  begin_command();
  submitted_ = true;
  if (!passes_.empty()) recording_->write_timestamp();
  check(vkEndCommandBuffer(recording_->commands), "ending a command list");
  context_->run_and_wait(recording_->commands, "running a command list");

  const std::vector<std::uint64_t> ticks = recording_->read_timestamps();
  const std::uint32_t bits = context_->timestamp_bits();
  const std::uint64_t mask = bits < 64 ? (std::uint64_t{1} << bits) - 1 : ~std::uint64_t{0};
  std::vector<PassTime> times;
  for (std::size_t i = 0; i < passes_.size(); ++i) {
    const std::uint64_t passed = (ticks[i + 1] - ticks[i]) & mask;
    const double ns = static_cast<double>(passed) * static_cast<double>(context_->limits().timestampPeriod);
    times.push_back({passes_[i], ns * 1e-6});
  }
  return times;
}

}  // namespace lumigraft::relight::gpu::vulkan
