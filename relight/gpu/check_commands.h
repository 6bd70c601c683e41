#pragma once
// Detects misuse before the driver sees it, and reports it with the names of the shader's source. All throw
// std::logic_error.
#include "relight/gpu/shader_reflection.h"

namespace lumigraft::relight::gpu {

/// Checks `desc` against the shaders' inputs and outputs.
void check_raster_desc(const std::string& shader, const ShaderInterface& interface, const RasterDesc& desc);

void check_groups(const std::string& shader, const std::array<int, 3>& groups,
                  const std::array<std::uint32_t, 3>& max_groups);

void check_draw(const std::string& shader, const RasterDesc& desc, std::span<const Attachment> colors,
                const Attachment* depth, std::span<const DrawCall> calls, const Area* area);

/// "mip 1 of texture "albedo" (64x64 rgba8_unorm)".
std::string mip_text(const Texture& texture, int mip);
void check_upload(const Texture& texture, int mip, std::size_t bytes);
void check_upload_rgb(const Texture& texture, std::size_t bytes);
void check_upload(const Buffer& buffer, const std::string& name, std::size_t offset, std::size_t bytes);

}  // namespace lumigraft::relight::gpu
