#include "relight/gpu/egl/glsl.h"

#include <spirv_cross_c.h>

#include <array>
#include <memory>

namespace lumigraft::relight::gpu::egl {

std::map<int, int> assign_units(const ShaderInterface& interface) {
  std::map<int, int> units;
  std::array<int, 3> next{};
  for (const auto& [number, slot] : interface.slots) {
    if (slot.used) units[number] = next[static_cast<std::size_t>(slot.kind)]++;
  }
  return units;
}

std::string glsl_of(const ShaderCode& shader, const std::map<int, int>& units) {
  spvc_context raw = nullptr;
  if (spvc_context_create(&raw) != SPVC_SUCCESS) throw GpuError("SPIRV-Cross cannot start");
  const std::unique_ptr<std::remove_pointer_t<spvc_context>, decltype(&spvc_context_destroy)> context(
      raw, &spvc_context_destroy);
  const auto check = [&](spvc_result result) {
    if (result == SPVC_SUCCESS) return;
    throw GpuError("shader " + std::string(shader.name) + " to GLSL: " + spvc_context_get_last_error_string(raw));
  };

  spvc_parsed_ir ir = nullptr;
  spvc_compiler compiler = nullptr;
  check(spvc_context_parse_spirv(raw, shader.spirv.data(), shader.spirv.size(), &ir));
  check(spvc_context_create_compiler(raw, SPVC_BACKEND_GLSL, ir, SPVC_CAPTURE_MODE_TAKE_OWNERSHIP, &compiler));
  spvc_compiler_options options = nullptr;
  check(spvc_compiler_create_compiler_options(compiler, &options));
  check(spvc_compiler_options_set_uint(options, SPVC_COMPILER_OPTION_GLSL_VERSION, 450));
  check(spvc_compiler_options_set_bool(options, SPVC_COMPILER_OPTION_GLSL_ES, SPVC_FALSE));
  check(spvc_compiler_options_set_bool(options, SPVC_COMPILER_OPTION_GLSL_VULKAN_SEMANTICS, SPVC_FALSE));
  check(spvc_compiler_install_compiler_options(compiler, options));

  // Unused resources have no unit, and are removed.
  spvc_set active = nullptr;
  check(spvc_compiler_get_active_interface_variables(compiler, &active));
  spvc_resources resources = nullptr;
  check(spvc_compiler_create_shader_resources_for_active_variables(compiler, &resources, active));
  check(spvc_compiler_set_enabled_interface_variables(compiler, active));
  for (const auto type :
       {SPVC_RESOURCE_TYPE_SAMPLED_IMAGE, SPVC_RESOURCE_TYPE_STORAGE_IMAGE, SPVC_RESOURCE_TYPE_STORAGE_BUFFER}) {
    const spvc_reflected_resource* first = nullptr;
    std::size_t count = 0;
    check(spvc_resources_get_resource_list_for_type(resources, type, &first, &count));
    for (std::size_t i = 0; i < count; ++i) {
      const auto slot = static_cast<int>(spvc_compiler_get_decoration(compiler, first[i].id, SpvDecorationBinding));
      spvc_compiler_set_decoration(compiler, first[i].id, SpvDecorationBinding, static_cast<unsigned>(units.at(slot)));
    }
  }
  const char* text = nullptr;
  check(spvc_compiler_compile(compiler, &text));
  return text;
}

}  // namespace lumigraft::relight::gpu::egl
