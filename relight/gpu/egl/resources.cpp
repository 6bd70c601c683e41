#include "relight/gpu/egl/resources.h"

#include "relight/gpu/check_commands.h"
#include "relight/gpu/formats.h"

namespace lumigraft::relight::gpu::egl {
GlFormat gl_format(Format format) {
  static constexpr FormatTable<GlFormat> formats{{{{GL_R8, GL_RED, GL_UNSIGNED_BYTE},
                                                   {GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE},
                                                   {GL_SRGB8_ALPHA8, GL_RGBA, GL_UNSIGNED_BYTE},
                                                   {GL_R16F, GL_RED, GL_HALF_FLOAT},
                                                   {GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT},
                                                   {GL_R32F, GL_RED, GL_FLOAT},
                                                   {GL_RG32F, GL_RG, GL_FLOAT},
                                                   {GL_RGBA32F, GL_RGBA, GL_FLOAT},
                                                   {GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT}}}};
  return formats[format];
}

EglTexture::EglTexture(std::shared_ptr<Context> context, const TextureDesc& desc)
    : Texture(desc, context->holdings()), context_(std::move(context)) {
  const Limits& limits = context_->limits();
  check_texture_edge(desc_, is_volume(desc_) ? limits.volume_edge : limits.texture_edge, context_->name());
  const Current current = context_->enter();
  try {
    const GLenum internal = gl_format(desc_.format).internal;
    glCreateTextures(is_volume(desc_) ? GL_TEXTURE_3D : GL_TEXTURE_2D, 1, &handle_);
    if (is_volume(desc_)) {
      glTextureStorage3D(handle_, desc_.mips, internal, desc_.width, desc_.height, desc_.depth);
    } else {
      glTextureStorage2D(handle_, desc_.mips, internal, desc_.width, desc_.height);
    }
    context_->check("creating " + text_of(desc_));
    clear({});
    context_->check("clearing " + text_of(desc_));
  } catch (...) {
    destroy();
    throw;
  }
}

void EglTexture::destroy() {
  const Current current(context_->handle(), std::nothrow);
  if (current.good()) glDeleteTextures(1, &handle_);
}

void EglTexture::clear(const std::array<float, 4>& value) const {
  for (int mip = 0; mip < desc_.mips; ++mip) {
    glClearTexImage(handle_, mip, is_depth(desc_.format) ? GL_DEPTH_COMPONENT : GL_RGBA, GL_FLOAT, value.data());
  }
}

void EglTexture::upload(int mip, std::span<const std::byte> texels) const {
  const GlFormat format = gl_format(desc_.format);
  const int width = mip_edge(desc_.width, mip), height = mip_edge(desc_.height, mip);
  if (is_volume(desc_)) {
    glTextureSubImage3D(handle_, mip, 0, 0, 0, width, height, mip_edge(desc_.depth, mip), format.layout, format.type,
                        texels.data());
  } else {
    glTextureSubImage2D(handle_, mip, 0, 0, width, height, format.layout, format.type, texels.data());
  }
}

void EglTexture::upload_rgb(std::span<const std::uint8_t> rgb) const {
  glTextureSubImage2D(handle_, 0, 0, 0, desc_.width, desc_.height, GL_RGB, GL_UNSIGNED_BYTE, rgb.data());
}

std::vector<std::byte> EglTexture::download(int mip) const {
  const GlFormat format = gl_format(desc_.format);
  std::vector<std::byte> texels(mip_bytes(desc_, mip));
  glGetTextureSubImage(handle_, mip, 0, 0, 0, mip_edge(desc_.width, mip), mip_edge(desc_.height, mip),
                       mip_edge(desc_.depth, mip), format.layout, format.type, static_cast<GLsizei>(texels.size()),
                       texels.data());
  return texels;
}

std::vector<std::byte> EglTexture::download(const Area& area) const {
  const GlFormat format = gl_format(desc_.format);
  std::vector<std::byte> texels(area_bytes(desc_, area));
  glGetTextureSubImage(handle_, 0, area.x, area.y, 0, area.width, area.height, 1, format.layout, format.type,
                       static_cast<GLsizei>(texels.size()), texels.data());
  return texels;
}

EglBuffer::EglBuffer(std::shared_ptr<Context> context, std::size_t size_bytes, const std::string& name)
    : Buffer(size_bytes, name, context->holdings()), context_(std::move(context)) {
  check_buffer_bytes(*this, context_->limits().storage_bytes, context_->name());
  const Current current = context_->enter();
  try {
    const std::size_t words = (size_bytes + 3) / 4 * 4;  // fills and shaders access whole words
    glCreateBuffers(1, &handle_);
    glNamedBufferStorage(handle_, static_cast<GLsizeiptr>(words), nullptr, GL_DYNAMIC_STORAGE_BIT);
    context_->check("creating buffer \"" + name_ + "\"");
    fill(0);
    context_->check("clearing buffer \"" + name_ + "\"");
  } catch (...) {
    destroy();
    throw;
  }
}

void EglBuffer::destroy() {
  const Current current(context_->handle(), std::nothrow);
  if (current.good()) glDeleteBuffers(1, &handle_);
}

void EglBuffer::fill(std::uint32_t value) const {
  glClearNamedBufferData(handle_, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &value);
}

}  // namespace lumigraft::relight::gpu::egl
