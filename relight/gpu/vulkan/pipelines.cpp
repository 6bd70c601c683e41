#include "relight/gpu/vulkan/pipelines.h"

#include "relight/gpu/check_commands.h"
#include "relight/gpu/vulkan/choose_device.h"

namespace lumigraft::relight::gpu::vulkan {
namespace {

/// A shader module, needed only until its pipeline is created.
class Module {
 public:
  Module(const Context& context, const ShaderCode& shader) : device_(context.device()) {
    const VkShaderModuleCreateInfo info{.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                        .pNext = nullptr,
                                        .flags = 0,
                                        .codeSize = shader.spirv.size_bytes(),
                                        .pCode = shader.spirv.data()};
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
  VkPipelineShaderStageCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage = which;
  info.module = module;
  info.pName = "main";
  return info;
}

VkFormat vk_format(VertexFormat format) {
  switch (format) {
    case VertexFormat::float2:
      return VK_FORMAT_R32G32_SFLOAT;
    case VertexFormat::float3:
      return VK_FORMAT_R32G32B32_SFLOAT;
    case VertexFormat::float4:
      return VK_FORMAT_R32G32B32A32_SFLOAT;
  }
  throw std::logic_error("gpu: unknown vertex format");
}

}  // namespace

VkDescriptorType descriptor_type(Binding::Kind kind) {
  switch (kind) {
    case Binding::Kind::sampled:
      return VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
    case Binding::Kind::storage_image:
      return VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
    case Binding::Kind::storage_buffer:
      return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
  }
  throw std::logic_error("gpu: unknown kind of binding");
}

PipelineObjects::~PipelineObjects() {
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
  const VkDescriptorSetLayoutCreateInfo set{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                            .pNext = nullptr,
                                            .flags = 0,
                                            .bindingCount = static_cast<std::uint32_t>(bindings.size()),
                                            .pBindings = bindings.data()};
  check(vkCreateDescriptorSetLayout(context->device(), &set, nullptr, &set_layout), "layout of shader " + name);
  VkPipelineLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  info.setLayoutCount = 1;
  info.pSetLayouts = &set_layout;
  check(vkCreatePipelineLayout(context->device(), &info, nullptr, &layout), "layout of shader " + name);
}

VulkanCompute::VulkanCompute(std::shared_ptr<Context> context, const ShaderCode& shader)
    : shader_(shader), objects_(std::move(context)) {
  objects_.name = shader.name;
  objects_.interface = reflect_shader(shader);
  objects_.create_layout(VK_SHADER_STAGE_COMPUTE_BIT);
}

const PipelineObjects& VulkanCompute::objects() const {
  if (objects_.handle != VK_NULL_HANDLE) return objects_;
  const Context& context = *objects_.context;
  const Module module(context, shader_);
  VkComputePipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  info.stage = stage(VK_SHADER_STAGE_COMPUTE_BIT, module.handle);
  info.layout = objects_.layout;
  check(vkCreateComputePipelines(context.device(), VK_NULL_HANDLE, 1, &info, nullptr, &objects_.handle),
        "pipeline of shader " + objects_.name);
  return objects_;
}

VulkanRaster::VulkanRaster(std::shared_ptr<Context> context, const RasterDesc& desc, const ShaderCode& vertex,
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
  std::vector<VkVertexInputAttributeDescription> attributes;
  for (const VertexAttribute& attribute : desc_.attributes) {
    attributes.push_back({static_cast<std::uint32_t>(attribute.location), 0, vk_format(attribute.format),
                          static_cast<std::uint32_t>(attribute.offset_bytes)});
  }
  VkPipelineVertexInputStateCreateInfo input{};
  input.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
  input.vertexBindingDescriptionCount = attributes.empty() ? 0 : 1;
  input.pVertexBindingDescriptions = &vertex_buffer;
  input.vertexAttributeDescriptionCount = static_cast<std::uint32_t>(attributes.size());
  input.pVertexAttributeDescriptions = attributes.data();

  VkPipelineInputAssemblyStateCreateInfo assembly{};
  assembly.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;

  VkPipelineViewportStateCreateInfo viewport{};
  viewport.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
  viewport.viewportCount = viewport.scissorCount = 1;

  // Vulkan defines winding in framebuffer coordinates, row 0 at the top: counter-clockwise as in device.h.
  VkPipelineRasterizationStateCreateInfo rasterization{};
  rasterization.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO;
  rasterization.cullMode = desc_.cull_back ? VK_CULL_MODE_BACK_BIT : VK_CULL_MODE_NONE;
  rasterization.frontFace = VK_FRONT_FACE_COUNTER_CLOCKWISE;
  rasterization.lineWidth = 1.0f;

  VkPipelineMultisampleStateCreateInfo samples{};
  samples.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;

  VkPipelineDepthStencilStateCreateInfo depth{};
  depth.sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO;
  depth.depthTestEnable = depth.depthWriteEnable = desc_.depth_test;
  depth.depthCompareOp = VK_COMPARE_OP_LESS_OR_EQUAL;

  VkPipelineColorBlendAttachmentState overwrite{};
  overwrite.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
  const std::vector<VkPipelineColorBlendAttachmentState> overwrites(desc_.color_formats.size(), overwrite);
  VkPipelineColorBlendStateCreateInfo blend{};
  blend.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
  blend.attachmentCount = static_cast<std::uint32_t>(overwrites.size());
  blend.pAttachments = overwrites.data();

  const VkDynamicState dynamic_states[] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  VkPipelineDynamicStateCreateInfo dynamic{};
  dynamic.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO;
  dynamic.dynamicStateCount = std::size(dynamic_states);
  dynamic.pDynamicStates = dynamic_states;

  std::vector<VkFormat> colors;
  for (const Format format : desc_.color_formats) colors.push_back(vulkan::vk_format(format));
  VkPipelineRenderingCreateInfo rendering{};
  rendering.sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO;
  rendering.colorAttachmentCount = static_cast<std::uint32_t>(colors.size());
  rendering.pColorAttachmentFormats = colors.data();
  rendering.depthAttachmentFormat = desc_.depth_test ? VK_FORMAT_D32_SFLOAT : VK_FORMAT_UNDEFINED;

  VkGraphicsPipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
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
