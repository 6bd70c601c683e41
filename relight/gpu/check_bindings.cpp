// Detects wrong bindings when a command is recorded, on every device, and reports them with the names of the shader's
// source.
#include <algorithm>

#include "relight/gpu/formats.h"
#include "relight/gpu/shader_reflection.h"

namespace lumigraft::relight::gpu {
namespace {

std::string text_of(Binding::Kind kind) {
  constexpr const char* texts[] = {"a sampled texture", "a storage image", "a storage buffer"};
  return texts[static_cast<std::size_t>(kind)];
}

/// Why `binding` does not match `slot`; empty if it does.
std::string misfit(const ShaderSlot& slot, const Binding& binding) {
  if (binding.kind != slot.kind) return "wants " + text_of(slot.kind) + ", not " + text_of(binding.kind);
  if (binding.kind == Binding::Kind::storage_buffer) return binding.buffer ? "" : "has no buffer";
  if (!binding.texture) return "has no texture";

  const TextureDesc& desc = binding.texture->desc();
  const std::string texture = gpu::text_of(desc);
  if (slot.volume != is_volume(desc))
    return std::string("wants a ") + (slot.volume ? "3D" : "2D") + " image, not " + texture;
  if (slot.integer != is_integer(desc.format)) {
    return std::string("wants ") + (slot.integer ? "integers" : "floats") + ", not " + texture;
  }
  if (binding.mip < 0 || binding.mip >= desc.mips) {
    return "wants mip " + std::to_string(binding.mip) + " of " + texture + ", which has " + std::to_string(desc.mips);
  }
  if (binding.kind == Binding::Kind::storage_image && slot.format != desc.format) {
    return "declares " + std::string(name_of(*slot.format)) + ", not the format of " + texture;
  }
  if (binding.kind == Binding::Kind::sampled && binding.filter != Filter::nearest &&
      (is_integer(desc.format) || is_depth(desc.format))) {
    return "cannot filter " + texture;
  }
  return "";
}

}  // namespace

void check_bindings(const std::string& shader, const ShaderInterface& interface, std::span<const Binding> bindings,
                    std::span<const std::byte> params) {
  const auto slot_text = [](int slot, const std::string& name) {
    return "slot " + std::to_string(slot) + (name.empty() ? "" : " \"" + name + "\"");
  };

  // The last member of a std140 block may end before the C++ struct, which is padded to 16 bytes.
  const std::size_t padded = (interface.params_bytes + 15) / 16 * 16;
  const bool fits = params.size() >= interface.params_bytes && params.size() <= padded;
  if (!fits && (interface.params_used || !params.empty())) {
    refuse(shader, "params has " + std::to_string(params.size()) + " bytes, its uniform block " +
                       std::to_string(interface.params_bytes));
  }

  for (std::size_t i = 0; i < bindings.size(); ++i) {
    const Binding& binding = bindings[i];
    const auto slot = interface.slots.find(binding.slot);
    if (slot == interface.slots.end()) refuse(shader, slot_text(binding.slot, "") + " is bound but not declared");
    for (std::size_t j = 0; j < i; ++j) {
      if (bindings[j].slot == binding.slot)
        refuse(shader, slot_text(binding.slot, slot->second.name) + " is bound twice");
    }
    if (const std::string why = misfit(slot->second, binding); !why.empty()) {
      refuse(shader, slot_text(binding.slot, slot->second.name) + " " + why);
    }
  }

  for (const auto& [number, slot] : interface.slots) {
    const bool bound =
        std::any_of(bindings.begin(), bindings.end(), [&](const Binding& b) { return b.slot == number; });
    if (slot.used && !bound) refuse(shader, slot_text(number, slot.name) + " has nothing bound");
  }
}

}  // namespace lumigraft::relight::gpu
