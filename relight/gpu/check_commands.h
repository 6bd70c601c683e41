#pragma once
// Detects misuse before the driver sees it, and reports it with the names of the shader's source. All throw
// std::logic_error, or GpuError where the device cannot do what another could.
#include "relight/gpu/shader_reflection.h"

namespace lumigraft::relight::gpu {

/// Checks `desc` against the shaders' inputs and outputs.
void check_raster_desc(const std::string& shader, const ShaderInterface& interface, const RasterDesc& desc);

/// The device creates edges and buffers up to `max_size`.
void check_texture_edge(const TextureDesc& desc, std::size_t max_size, const std::string& device);
void check_buffer_bytes(const Buffer& buffer, std::size_t max_size, const std::string& device);

/// Throws std::logic_error naming the shader and the slot if `bindings` or `params` don't match.
void check_bindings(const std::string& shader, const ShaderInterface& interface, std::span<const Binding> bindings,
                    std::span<const std::byte> params);

void check_groups(const std::string& shader, const std::array<int, 3>& groups,
                  const std::array<std::uint32_t, 3>& max_groups);

void check_draw(const std::string& shader, const RasterDesc& desc, const std::vector<const Texture*>& colors,
                const Texture& depth, std::span<const DrawCall> calls, const Area* area);

/// "mip 1 of texture "albedo" (64x64 rgba8_unorm)".
std::string mip_text(const Texture& texture, int mip);
void check_upload(const Texture& texture, int mip, std::size_t bytes);
void check_upload_rgb(const Texture& texture, std::size_t bytes);
void check_upload(const Buffer& buffer, std::size_t offset, std::size_t bytes);
void check_part(const TexturePart& part);

/// The backend's own object of a caller's. Throws std::logic_error if it belongs to another device.
template <typename Own, typename Object, typename Context>
Own& own_object(Object& object, const Context& context, const std::string& what) {
  auto* own = dynamic_cast<Own*>(&object);
  if (own != nullptr && own->context() == &context) return *own;
  throw std::logic_error(what + " belongs to another device");
}
template <typename Own, typename Context>
const Own& own(const Texture& texture, const Context& context) {
  return own_object<const Own>(texture, context, "texture \"" + texture.desc().name + "\"");
}
template <typename Own, typename Context>
const Own& own(const Buffer& buffer, const Context& context) {
  return own_object<const Own>(buffer, context, "a buffer");
}

}  // namespace lumigraft::relight::gpu
