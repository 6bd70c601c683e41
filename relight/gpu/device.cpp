#include "relight/gpu/device.h"

#include <algorithm>
#include <bit>

#include "relight/gpu/formats.h"

namespace lumigraft::relight::gpu {

std::size_t bytes_per_texel(Format format) {
  switch (format) {
    case Format::r8_unorm:
      return 1;
    case Format::r16_float:
      return 2;
    case Format::rgba8_unorm:
    case Format::r32_float:
    case Format::r32_uint:
    case Format::depth32_float:
      return 4;
    case Format::rgba16_float:
    case Format::rg32_float:
      return 8;
    case Format::rgba32_float:
      return 16;
  }
  throw std::logic_error("gpu: unknown format");
}

std::string_view name_of(Format format) {
  switch (format) {
    case Format::r8_unorm:
      return "r8_unorm";
    case Format::rgba8_unorm:
      return "rgba8_unorm";
    case Format::r16_float:
      return "r16_float";
    case Format::rgba16_float:
      return "rgba16_float";
    case Format::r32_float:
      return "r32_float";
    case Format::rg32_float:
      return "rg32_float";
    case Format::rgba32_float:
      return "rgba32_float";
    case Format::r32_uint:
      return "r32_uint";
    case Format::depth32_float:
      return "depth32_float";
  }
  throw std::logic_error("gpu: unknown format");
}

std::string size_text(const TextureDesc& desc) {
  std::string text = std::to_string(desc.width) + "x" + std::to_string(desc.height);
  if (is_volume(desc)) text += "x" + std::to_string(desc.depth);
  return text + " " + std::string(name_of(desc.format));
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
  const auto refuse = [&](const std::string& why) {
    throw std::logic_error("texture \"" + desc.name + "\" (" + size_text(desc) + "): " + why);
  };
  if (desc.width < 1 || desc.height < 1 || desc.depth < 1) refuse("every edge must be at least 1");
  const int longest = std::max({desc.width, desc.height, desc.depth});
  const int max_mips = std::bit_width(static_cast<unsigned>(longest));
  if (desc.mips < 1 || desc.mips > max_mips) {
    refuse(std::to_string(desc.mips) + " mips; allowed are 1 to " + std::to_string(max_mips));
  }
  if (is_volume(desc) && desc.attachment) refuse("a volume cannot be an attachment");
  if (is_volume(desc) && is_depth(desc.format)) refuse("a volume cannot hold depth32_float");
}

Binding sampled(int slot, const Texture& texture, Filter filter) {
  Binding binding{Binding::Kind::sampled, slot};
  binding.texture = &texture;
  binding.filter = filter;
  return binding;
}

Binding image(int slot, const Texture& texture, int mip) {
  Binding binding{Binding::Kind::storage_image, slot};
  binding.texture = &texture;
  binding.mip = mip;
  return binding;
}

Binding storage(int slot, const Buffer& buffer) {
  Binding binding{Binding::Kind::storage_buffer, slot};
  binding.buffer = &buffer;
  return binding;
}

}  // namespace lumigraft::relight::gpu
