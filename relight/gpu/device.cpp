#include "relight/gpu/device.h"

#include <algorithm>
#include <bit>

#include "relight/gpu/formats.h"

namespace lumigraft::relight::gpu {

namespace {

struct FormatFacts {
  std::string_view name;
  std::size_t texel_bytes;
};
constexpr FormatTable<FormatFacts> format_facts{{{{"r8_unorm", 1},
                                                  {"rgba8_unorm", 4},
                                                  {"rgba8_srgb", 4},
                                                  {"r16_float", 2},
                                                  {"rgba16_float", 8},
                                                  {"r32_float", 4},
                                                  {"rg32_float", 8},
                                                  {"rgba32_float", 16},
                                                  {"depth32_float", 4}}}};

}  // namespace

std::size_t bytes_per_texel(Format format) { return format_facts[format].texel_bytes; }

std::string_view name_of(Format format) { return format_facts[format].name; }

std::string text_of(const TextureDesc& desc) {
  std::string text = "texture \"" + desc.name + "\" (" + std::to_string(desc.width) + "x" + std::to_string(desc.height);
  if (is_volume(desc)) text += "x" + std::to_string(desc.depth);
  return text + " " + std::string(name_of(desc.format)) + ")";
}

std::size_t mip_bytes(const TextureDesc& desc, int mip) {
  return bytes_per_texel(desc.format) * static_cast<std::size_t>(mip_edge(desc.width, mip)) *
         static_cast<std::size_t>(mip_edge(desc.height, mip)) * static_cast<std::size_t>(mip_edge(desc.depth, mip));
}

std::size_t all_bytes(const TextureDesc& desc) {
  std::size_t bytes = 0;
  for (int mip = 0; mip < desc.mips; ++mip) bytes += mip_bytes(desc, mip);
  return bytes;
}

Texture::Texture(TextureDesc desc, std::shared_ptr<Holdings> holdings)
    : desc_(std::move(desc)), holdings_(std::move(holdings)) {
  check_texture_desc(desc_);
  holdings_->add(desc_.name, all_bytes(desc_));
}
Texture::~Texture() { holdings_->remove(desc_.name, all_bytes(desc_)); }

Buffer::Buffer(std::size_t size_bytes, std::string name, std::shared_ptr<Holdings> holdings)
    : size_bytes_(size_bytes), name_(std::move(name)), holdings_(std::move(holdings)) {
  if (size_bytes_ == 0) throw std::logic_error("buffer \"" + name_ + "\" has no bytes");
  holdings_->add(name_, size_bytes_);
}
Buffer::~Buffer() { holdings_->remove(name_, size_bytes_); }

void check_texture_desc(const TextureDesc& desc) {
  const auto refuse = [&](const std::string& why) { throw std::logic_error(text_of(desc) + ": " + why); };
  if (desc.width < 1 || desc.height < 1 || desc.depth < 1) refuse("every edge must be at least 1");
  const int longest = std::max({desc.width, desc.height, desc.depth});
  const int max_mips = std::bit_width(static_cast<unsigned>(longest));
  if (desc.mips < 1 || desc.mips > max_mips) {
    refuse(std::to_string(desc.mips) + " mips; allowed are 1 to " + std::to_string(max_mips));
  }
  if (is_volume(desc) && desc.attachment) refuse("a volume cannot be an attachment");
  if (is_volume(desc) && is_depth(desc.format)) refuse("a volume cannot hold depth32_float");
}

Binding sampled(int slot, const Texture& texture, Filter filter, Wrap wrap_u, Wrap wrap_v) {
  return {.kind = Binding::Kind::sampled, .slot = slot, .texture = &texture, .sampling = {filter, wrap_u, wrap_v}};
}

Binding image(int slot, const Texture& texture) {
  return {.kind = Binding::Kind::storage_image, .slot = slot, .texture = &texture};
}

Binding storage(int slot, const Buffer& buffer) {
  return {.kind = Binding::Kind::storage_buffer, .slot = slot, .buffer = &buffer};
}

}  // namespace lumigraft::relight::gpu
