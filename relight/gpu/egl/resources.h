#pragma once
// Textures and buffers of OpenGL.
#include "relight/gpu/egl/context.h"

namespace lumigraft::relight::gpu::egl {

/// OpenGL's names of a format: internal format, and format and type of transferred texels.
struct GlFormat {
  GLenum internal, layout, type;
};
GlFormat gl_format(Format format);

class EglTexture final : public Texture {
 public:
  EglTexture(std::shared_ptr<Context> context, const TextureDesc& desc);
  ~EglTexture() override { destroy(); }

  const Context* context() const { return context_.get(); }
  GLuint handle() const { return handle_; }
  void clear(const std::array<float, 4>& value) const;
  void upload(int mip, std::span<const std::byte> texels) const;
  void upload_rgb(std::span<const std::uint8_t> rgb) const;
  std::vector<std::byte> download(int mip) const;
  std::vector<std::byte> download(const Area& area) const;  ///< of mip 0 of a 2D texture

 private:
  void destroy();

  std::shared_ptr<Context> context_;
  GLuint handle_ = 0;
};

class EglBuffer final : public Buffer {
 public:
  EglBuffer(std::shared_ptr<Context> context, std::size_t size_bytes, const std::string& name);
  ~EglBuffer() override { destroy(); }

  const Context* context() const { return context_.get(); }
  GLuint handle() const { return handle_; }
  void fill(std::uint32_t value) const;

 private:
  void destroy();

  std::shared_ptr<Context> context_;
  GLuint handle_ = 0;
};

}  // namespace lumigraft::relight::gpu::egl
