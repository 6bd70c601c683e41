#pragma once
// A shader's interface, read from its SPIR-V: pipelines need no hand-written layouts, and a wrong binding is detected
// at record time. Used by all devices.
#include <map>
#include <optional>
#include <string>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

struct ShaderSlot {
  std::string name;  ///< in the GLSL source
  Binding::Kind kind = Binding::Kind::sampled;
  bool used = false;                  ///< false: declared but not accessed, needs no binding
  bool volume = false;                ///< images: 3D, else 2D
  std::optional<Format> format = {};  ///< storage images: the layout qualifier
};

struct ShaderInterface {
  std::size_t params_bytes = 0;  ///< of the uniform block at binding 0; 0: none
  bool params_used = false;
  std::map<int, ShaderSlot> slots;             ///< by binding, from 1
  std::map<int, std::string> inputs, outputs;  ///< by location: vertex attributes, fragment outputs
};

/// Throws std::logic_error naming the shader if it uses features that device.h lacks.
ShaderInterface reflect_shader(const ShaderCode& shader);

/// The slots of both stages. Throws std::logic_error if they contradict each other.
ShaderInterface join_stages(const std::string& name, const ShaderInterface& vertex, const ShaderInterface& fragment);

[[noreturn]] void refuse(std::string_view shader, const std::string& why);  ///< throws std::logic_error

/// Searches the product's shaders and `more`. Throws std::logic_error for an unknown name.
const ShaderCode& find_shader(std::string_view name, std::span<const ShaderCode> more);

}  // namespace lumigraft::relight::gpu
