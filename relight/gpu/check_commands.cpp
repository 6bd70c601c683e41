#include "relight/gpu/check_commands.h"

#include <algorithm>

#include "relight/gpu/formats.h"

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
  if (binding.kind == Binding::Kind::storage_image && slot.format != desc.format) {
    return "declares " + std::string(name_of(*slot.format)) + ", not the format of " + texture;
  }
  if (binding.kind == Binding::Kind::sampled && binding.sampling.filter != Filter::nearest && is_depth(desc.format)) {
    return "cannot filter " + texture;
  }
  return "";
}

/// Checks that all targets of a draw are distinct and of one size, and returns them.
std::vector<const Texture*> checked_targets(const std::string& shader, const RasterDesc& desc,
                                            const std::vector<const Texture*>& colors, const Texture& depth) {
  std::vector<const Texture*> targets;
  const auto add = [&](const std::string& which, const Texture* texture, Format format) {
    const TextureDesc& target = texture->desc();
    const std::string text = which + ", " + text_of(target) + ", ";
    if (!target.attachment) refuse(shader, text + "was not made as an attachment");
    if (target.format != format) refuse(shader, text + "is not " + std::string(name_of(format)));
    if (!targets.empty() && (target.width != targets[0]->desc().width || target.height != targets[0]->desc().height)) {
      refuse(shader, text + "has another size than \"" + targets[0]->desc().name + "\"");
    }
    if (std::ranges::count(targets, texture) > 0) refuse(shader, text + "is drawn to twice");
    targets.push_back(texture);
  };
  for (std::size_t i = 0; i < colors.size(); ++i) add("colour " + std::to_string(i), colors[i], desc.color_formats[i]);
  add("depth", &depth, Format::depth32_float);
  return targets;
}

}  // namespace

void check_raster_desc(const std::string& shader, const ShaderInterface& interface, const RasterDesc& desc) {
  for (const auto& [location, name] : interface.inputs) {
    const bool given =
        std::any_of(desc.attributes.begin(), desc.attributes.end(),
                    [at = location](const VertexAttribute& attribute) { return attribute.location == at; });
    if (!given) refuse(shader, "no attribute for location " + std::to_string(location) + " \"" + name + "\"");
  }
  for (const auto& [location, name] : interface.outputs) {
    if (location >= static_cast<int>(desc.color_formats.size())) {
      refuse(shader, "no colour format for output " + std::to_string(location) + " \"" + name + "\"");
    }
  }
  for (std::size_t i = 0; i < desc.color_formats.size(); ++i) {
    if (is_depth(desc.color_formats[i])) refuse(shader, "depth32_float is not a colour format");
    if (!interface.outputs.contains(static_cast<int>(i))) {
      refuse(shader, "colour " + std::to_string(i) + " is never written");
    }
  }
  if (desc.vertex_stride_bytes <= 0) refuse(shader, "attributes without a vertex stride");
}

void check_texture_edge(const TextureDesc& desc, std::size_t max_size, const std::string& device) {
  if (static_cast<std::size_t>(std::max({desc.width, desc.height, desc.depth})) <= max_size) return;
  throw GpuError(text_of(desc) + ": the longest edge of " + device + " is " + std::to_string(max_size));
}

void check_buffer_bytes(const Buffer& buffer, std::size_t max_size, const std::string& device) {
  if (buffer.size_bytes() <= max_size) return;
  throw GpuError("buffer \"" + buffer.name() + "\" has " + std::to_string(buffer.size_bytes()) +
                 " bytes; the maximum of " + device + " is " + std::to_string(max_size));
}

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
        std::any_of(bindings.begin(), bindings.end(), [wanted = number](const Binding& b) { return b.slot == wanted; });
    if (slot.used && !bound) refuse(shader, slot_text(number, slot.name) + " has nothing bound");
  }
}

void check_groups(const std::string& shader, const std::array<int, 3>& groups,
                  const std::array<std::uint32_t, 3>& max_groups) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (groups[i] < 0 || static_cast<std::uint32_t>(groups[i]) > max_groups[i]) {
      refuse(shader, std::to_string(groups[i]) + " groups; allowed are 0 to " + std::to_string(max_groups[i]));
    }
  }
}

void check_draw(const std::string& shader, const RasterDesc& desc, const std::vector<const Texture*>& colors,
                const Texture& depth, std::span<const DrawCall> calls, const Area* area) {
  if (colors.size() != desc.color_formats.size()) {
    refuse(shader, std::to_string(colors.size()) + " colour attachments; it has " +
                       std::to_string(desc.color_formats.size()) + " colour formats");
  }
  const std::vector<const Texture*> targets = checked_targets(shader, desc, colors, depth);
  if (area) {
    const TextureDesc& target = targets[0]->desc();
    const bool inside = area->x >= 0 && area->y >= 0 && area->width > 0 && area->height > 0 &&
                        area->x + area->width <= target.width && area->y + area->height <= target.height;
    if (!inside) refuse(shader, "draws outside " + text_of(target));
  }
  for (const DrawCall& call : calls) {
    for (const Binding& binding : call.bindings) {
      if (binding.texture && std::ranges::count(targets, binding.texture) > 0) {
        refuse(shader, "texture \"" + binding.texture->desc().name + "\" is bound while it is drawn to");
      }
    }
    if (!call.vertices || !call.indices) refuse(shader, "a draw call without vertices or indices");
    if (call.indices->size_bytes() / 4 < call.index_count) {
      refuse(shader, std::to_string(call.index_count) + " indices from a buffer of " +
                         std::to_string(call.indices->size_bytes() / 4));
    }
  }
}

std::string mip_text(const Texture& texture, int mip) {
  const TextureDesc& desc = texture.desc();
  const std::string text = "mip " + std::to_string(mip) + " of " + text_of(desc);
  if (mip < 0 || mip >= desc.mips) throw std::logic_error("there is no " + text);
  return text;
}

void check_upload(const Texture& texture, int mip, std::size_t bytes) {
  const std::string what = mip_text(texture, mip);
  if (bytes == mip_bytes(texture.desc(), mip)) return;
  throw std::logic_error("upload of " + std::to_string(bytes) + " bytes to " + what + ", which has " +
                         std::to_string(mip_bytes(texture.desc(), mip)));
}

void check_upload_rgb(const Texture& texture, std::size_t bytes) {
  const TextureDesc& desc = texture.desc();
  if (desc.format != Format::rgba8_unorm || is_volume(desc)) {
    throw std::logic_error("upload of RGB to " + text_of(desc) + "; allowed is rgba8_unorm without depth");
  }
  if (4 * bytes == 3 * mip_bytes(desc, 0)) return;
  throw std::logic_error("upload of " + std::to_string(bytes) + " bytes of RGB to " + mip_text(texture, 0) +
                         ", which takes " + std::to_string(mip_bytes(desc, 0) / 4 * 3));
}

void check_part(const TexturePart& part) {
  const TextureDesc& desc = part.texture->desc();
  const Area& area = part.area;
  if (!is_volume(desc) && area.x >= 0 && area.y >= 0 && area.width > 0 && area.height > 0 &&
      area.x + area.width <= desc.width && area.y + area.height <= desc.height)
    return;
  throw std::logic_error("download of " + std::to_string(area.width) + "x" + std::to_string(area.height) +
                         " texels at " + std::to_string(area.x) + ", " + std::to_string(area.y) + " of " +
                         text_of(desc) + "; allowed is what lies within a 2D texture");
}

void check_upload(const Buffer& buffer, std::size_t offset, std::size_t bytes) {
  if (offset <= buffer.size_bytes() && bytes <= buffer.size_bytes() - offset) return;
  throw std::logic_error("upload of " + std::to_string(bytes) + " bytes at " + std::to_string(offset) +
                         " to buffer \"" + buffer.name() + "\", which has " + std::to_string(buffer.size_bytes()));
}

}  // namespace lumigraft::relight::gpu
