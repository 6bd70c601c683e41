#pragma once
// Properties of formats, for all devices.
#include <array>
#include <string_view>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

/// A value for each format, in the order of the enumeration.
template <typename Value>
struct FormatTable {
  std::array<Value, static_cast<std::size_t>(Format::depth32_float) + 1> values;
  constexpr const Value& operator[](Format format) const { return values[static_cast<std::size_t>(format)]; }
};

std::string_view name_of(Format format);
std::string text_of(const TextureDesc& desc);  ///< texture "albedo" (64x64x64 rgba16_float)

inline bool is_depth(Format format) { return format == Format::depth32_float; }
/// Whether shaders write it as an image.
inline bool is_storable(Format format) { return !is_depth(format) && format != Format::rgba8_srgb; }
inline bool is_volume(const TextureDesc& desc) { return desc.volume || desc.depth > 1; }

/// Edge of a mip level: half of the previous, rounded down, at least 1.
inline int mip_edge(int edge, int mip) { return (edge >> mip) > 0 ? edge >> mip : 1; }
std::size_t mip_bytes(const TextureDesc& desc, int mip);
inline std::size_t area_bytes(const TextureDesc& desc, const Area& area) {
  return bytes_per_texel(desc.format) * static_cast<std::size_t>(area.width) * static_cast<std::size_t>(area.height);
}

/// Throws std::logic_error if no device could create such a texture.
void check_texture_desc(const TextureDesc& desc);

}  // namespace lumigraft::relight::gpu
