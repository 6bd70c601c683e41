#include "relight/gpu/vulkan/pipelines.h"

#include "relight/gpu/check_commands.h"
#include "relight/gpu/vulkan/choose_device.h"

namespace lumigraft::relight::gpu::vulkan {
namespace {

/// A shader module, needed only until its pipeline is created.
class Module {
 public:
  Module(const Context& context, const ShaderCode& shader) : device_(context.device()) {
    auto info = zeroed<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    info.codeSize = shader.spirv.size_bytes();
    info.pCode = shader.spirv.data();
    check(vkCreateShaderModule(device_, &info, nullptr, &handle), "shader " + std::string(shader.name));
  }
  ~Module() { vkDestroyShaderModule(device_, handle, nullptr); }
  Module(const Module&) = delete;
  Module& operator=(const Module&) = delete;

  VkShaderModule handle = VK_NULL_HANDLE;

 private:
  VkDevice device_;
};

VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits which, VkShaderModule module) {
  auto info = zeroed<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  info.stage = which;
  info.module = module;
  info.pName = "main";
  return info;
}

}  // namespace

VkDescriptorType descriptor_type(Binding::Kind kind) {
  constexpr VkDescriptorType types[] = {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,
                                        VK_DESCRIPTOR_TYPE_STORAGE_BUFFER};
  return types[static_cast<std::size_t>(kind)];
}

PipelineObjects::~PipelineObjects() {
  if (context->hung()) return;
  vkDestroyPipeline(context->device(), handle, nullptr);
  vkDestroyPipelineLayout(context->device(), layout, nullptr);
  vkDestroyDescriptorSetLayout(context->device(), set_layout, nullptr);
}

void PipelineObjects::create_layout(VkShaderStageFlags stages) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  if (interface.params_used) bindings.push_back({0, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 1, stages, nullptr});
  for (const auto& [number, slot] : interface.slots) {
    if (!slot.used) continue;
    bindings.push_back({static_cast<std::uint32_t>(number), descriptor_type(slot.kind), 1, stages, nullptr});
  }
  auto set = zeroed<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  set.bindingCount = static_cast<std::uint32_t>(bindings.size());
  set.pBindings = bindings.data();
  check(vkCreateDescriptorSetLayout(context->device(), &set, nullptr, &set_layout), "layout of shader " + name);
  auto info = zeroed<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.setLayoutCount = 1;
  info.pSetLayouts = &set_layout;
  check(vkCreatePipelineLayout(context->device(), &info, nullptr, &layout), "layout of shader " + name);
}

ComputeObjects::ComputeObjects(std::shared_ptr<Context> context, const ShaderCode& shader)
    : shader_(shader), objects_(std::move(context)) {
  objects_.name = shader.name;
  objects_.interface = reflect_shader(shader);
  objects_.create_layout(VK_SHADER_STAGE_COMPUTE_BIT);
}

const PipelineObjects& ComputeObjects::compiled() {
  if (objects_.handle != VK_NULL_HANDLE) return objects_;
  const Context& context = *objects_.context;
  const Module module(context, shader_);
  auto info = zeroed<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.stage = stage(VK_SHADER_STAGE_COMPUTE_BIT, module.handle);
  info.layout = objects_.layout;
  check(vkCreateComputePipelines(context.device(), VK_NULL_HANDLE, 1, &info, nullptr, &objects_.handle),
        "pipeline of shader " + objects_.name);
  return objects_;
}

VulkanRaster::VulkanRaster(const std::shared_ptr<Context>& context, const RasterDesc& desc, const ShaderCode& vertex,
                           const ShaderCode& fragment)
    : objects_(context), desc_(desc) {
  objects_.name = std::string(vertex.name) + " + " + std::string(fragment.name);
  objects_.interface = join_stages(objects_.name, reflect_shader(vertex), reflect_shader(fragment));
  check_raster_desc(objects_.name, objects_.interface, desc_);
  objects_.create_layout(VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT);
  const Module vertex_module(*context, vertex), fragment_module(*context, fragment);
  create(vertex_module.handle, fragment_module.handle);
}

void VulkanRaster::create(VkShaderModule vertex, VkShaderModule fragment) {
  const VkPipelineShaderStageCreateInfo stages[] = {stage(VK_SHADER_STAGE_VERTEX_BIT, vertex),
                                                    stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment)};

  const VkVertexInputBindingDescription vertex_buffer{0, static_cast<std::uint32_t>(desc_.vertex_stride_bytes),
                                                      VK_VERTEX_INPUT_RATE_VERTEX};
  constexpr VkFormat formats[] = {VK_FORMAT_R32G32_SFLOAT, VK_FORMAT_R32G32B32_SFLOAT, VK_FORMAT_R32G32B32A32_SFLOAT};
  std::vector<VkVertexInputAttributeDescription> attributes;
  for (const VertexAttribute& attribute : desc_.attributes) {
    attributes.push_back({static_cast<std::uint32_t>(attribute.location), 0, formats[attribute.floats - 2],
                          static_cast<std::uint32_t>(attribute.offset_bytes)});
  }
  auto input = zeroed<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
  input.vertexBindingDescriptionCount = 1;
  input.pVertexBindingDescriptions = &vertex_buffer;
  input.vertexAttributeDescriptionCount = static_cast<std::uint32_t>(attributes.size());
  input.pVertexAttributeDescriptions = attributes.data();

  auto assembly =
      zeroed<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;

  auto viewport = zeroed<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
  viewport.viewportCount = viewport.scissorCount = 1;

  // Vulkan defines winding in framebuffer coordinates, row 0 at the top: counter-clockwise as in device.h.
  auto rasterization =
      zeroed<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  rasterization.cullMode = VK_CULL_MODE_NONE;
  rasterization.frontFace = VK_FRONT_FACE_COUNTER_CLOCKWISE;
  rasterization.lineWidth = 1.0f;

  auto samples = zeroed<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;

  auto depth =
      zeroed<VkPipelineDepthStencilStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO);
  depth.depthTestEnable = depth.depthWriteEnable = VK_TRUE;
  depth.depthCompareOp = VK_COMPARE_OP_LESS_OR_EQUAL;

  VkPipelineColorBlendAttachmentState overwrite{};
  overwrite.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
  const std::vector<VkPipelineColorBlendAttachmentState> overwrites(desc_.color_formats.size(), overwrite);
  auto blend = zeroed<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
  blend.attachmentCount = static_cast<std::uint32_t>(overwrites.size());
  blend.pAttachments = overwrites.data();

  const VkDynamicState dynamic_states[] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  auto dynamic = zeroed<VkPipelineDynamicStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO);
  dynamic.dynamicStateCount = std::size(dynamic_states);
  dynamic.pDynamicStates = dynamic_states;

  std::vector<VkFormat> colors;
  for (const Format format : desc_.color_formats) colors.push_back(vk_format(format));
  auto rendering = zeroed<VkPipelineRenderingCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO);
  rendering.colorAttachmentCount = static_cast<std::uint32_t>(colors.size());
  rendering.pColorAttachmentFormats = colors.data();
  rendering.depthAttachmentFormat = VK_FORMAT_D32_SFLOAT;

  auto info = zeroed<VkGraphicsPipelineCreateInfo>(VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO);
  info.pNext = &rendering;
  info.stageCount = std::size(stages);
  info.pStages = stages;
  info.pVertexInputState = &input;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &viewport;
  info.pRasterizationState = &rasterization;
  info.pMultisampleState = &samples;
  info.pDepthStencilState = &depth;
  info.pColorBlendState = &blend;
  info.pDynamicState = &dynamic;
  info.layout = objects_.layout;
  check(vkCreateGraphicsPipelines(objects_.context->device(), VK_NULL_HANDLE, 1, &info, nullptr, &objects_.handle),
        "pipeline of shaders " + objects_.name);
}

}  // namespace lumigraft::relight::gpu::vulkan
