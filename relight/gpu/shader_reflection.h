#pragma once
// What a shader asks for, read from its SPIR-V: so pipelines need no hand-written layouts, and a wrong binding is found
// when it is recorded. Every device uses it.
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

struct ShaderSlot {
  std::string name;  ///< in the GLSL source
  Binding::Kind kind = Binding::Kind::sampled;
  bool used = false;             ///< a declared slot that no code reads or writes needs nothing bound
  bool volume = false;           ///< images: 3D, else 2D
  bool integer = false;          ///< images: usampler or uimage
  std::optional<Format> format;  ///< storage images: the layout qualifier
};

struct ShaderInterface {
  std::size_t params_bytes = 0;  ///< of the uniform block at binding 0; 0: none
  bool params_used = false;
  std::map<int, ShaderSlot> slots;             ///< by binding, 1 and up
  std::map<int, std::string> inputs, outputs;  ///< by location: vertex attributes, fragment outputs
};

/// Throws std::logic_error that names the shader where it uses what device.h doesn't have.
ShaderInterface reflect_shader(const ShaderCode& shader);

/// The slots of both stages. Throws std::logic_error where they contradict each other.
ShaderInterface join_stages(const std::string& name, const ShaderInterface& vertex, const ShaderInterface& fragment);

/// Throws std::logic_error naming the shader and the slot where `bindings` and `params` don't fit.
void check_bindings(const std::string& shader, const ShaderInterface& interface, std::span<const Binding> bindings,
                    std::span<const std::byte> params);

/// Among the product's shaders and `more`. Throws std::logic_error for an unknown name.
const ShaderCode& find_shader(std::string_view name, std::span<const ShaderCode> more);

}  // namespace lumigraft::relight::gpu
