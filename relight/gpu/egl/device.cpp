#include "relight/gpu/device.h"

#include "relight/gpu/check_commands.h"
#include "relight/gpu/egl/choose_device.h"
#include "relight/gpu/egl/command_list.h"

namespace lumigraft::relight::gpu {
namespace egl {
namespace {

class EglDevice final : public Device {
 public:
  EglDevice(std::shared_ptr<Context> context, std::span<const ShaderCode> more_shaders)
      : context_(std::move(context)), more_shaders_(more_shaders.begin(), more_shaders.end()) {}

  std::string name() const override { return context_->name(); }
  bool is_software() const override { return draws_in_software(context_->name()); }
  const Holdings& holdings() const override { return *context_->holdings(); }

  std::unique_ptr<Texture> create_texture(const TextureDesc& desc) override {
    return std::make_unique<EglTexture>(context_, desc);
  }
  std::unique_ptr<Buffer> create_buffer(std::size_t size_bytes, std::string_view name) override {
    return std::make_unique<EglBuffer>(context_, size_bytes, std::string(name));
  }
  std::unique_ptr<ComputePipeline> create_compute(std::string_view shader) override {
    return std::make_unique<EglCompute>(context_, find_shader(shader, more_shaders_));
  }
  std::unique_ptr<RasterPipeline> create_raster(const RasterDesc& desc) override {
    return std::make_unique<EglRaster>(context_, desc, find_shader(desc.vertex_shader, more_shaders_),
                                       find_shader(desc.fragment_shader, more_shaders_));
  }

  void upload(const Texture& texture, int mip, std::span<const std::byte> texels) override {
    const EglTexture& target = own<EglTexture>(texture, *context_);
    check_upload(texture, mip, texels.size());
    const Current current = context_->enter();
    target.upload(mip, texels);
    context_->check("upload to " + mip_text(texture, mip));
  }

  void upload_rgb(const Texture& texture, std::span<const std::uint8_t> rgb) override {
    const EglTexture& target = own<EglTexture>(texture, *context_);
    check_upload_rgb(texture, rgb.size());
    const Current current = context_->enter();
    target.upload_rgb(rgb);
    context_->check("upload to " + mip_text(texture, 0));
  }

  void upload(const Buffer& buffer, std::size_t offset, std::span<const std::byte> bytes) override {
    const EglBuffer& target = own<EglBuffer>(buffer, *context_);
    check_upload(buffer, offset, bytes.size());
    const Current current = context_->enter();
    glNamedBufferSubData(target.handle(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes.size()),
                         bytes.data());
    context_->check("upload to buffer \"" + target.name() + "\"");
  }

  std::vector<std::byte> download(const Texture& texture, int mip) override {
    const EglTexture& source = own<EglTexture>(texture, *context_);
    const std::string what = mip_text(texture, mip);
    const Current current = context_->enter();
    context_->finish("what precedes a download");
    std::vector<std::byte> texels = source.download(mip);
    context_->check("download of " + what);
    return texels;
  }

  std::vector<std::byte> download(const Buffer& buffer) override {
    const EglBuffer& source = own<EglBuffer>(buffer, *context_);
    const Current current = context_->enter();
    context_->finish("what precedes a download");
    std::vector<std::byte> bytes(buffer.size_bytes());
    glGetNamedBufferSubData(source.handle(), 0, static_cast<GLsizeiptr>(bytes.size()), bytes.data());
    context_->check("download of buffer \"" + source.name() + "\"");
    return bytes;
  }

  std::vector<std::vector<std::byte>> download(std::span<const TexturePart> parts) override {
    const Current current = context_->enter();
    context_->finish("what precedes a download");
    std::vector<std::vector<std::byte>> texels;
    for (const TexturePart& part : parts) {
      check_part(part);
      texels.push_back(own<EglTexture>(*part.texture, *context_).download(part.area));
      context_->check("download of part of texture \"" + part.texture->desc().name + "\"");
    }
    return texels;
  }

  std::unique_ptr<CommandList> begin() override {
    if (!texture_clear_ && !context_->is_software()) texture_clear_ = std::make_shared<TextureClear>(*this);
    return std::make_unique<EglCommandList>(context_, texture_clear_);
  }

  std::vector<PassTime> submit(CommandList& list) override {
    return own_object<EglCommandList>(list, *context_, "a command list").run();
  }

 private:
  std::shared_ptr<Context> context_;
  std::vector<ShaderCode> more_shaders_;
  std::shared_ptr<const TextureClear> texture_clear_;
};

}  // namespace
}  // namespace egl

std::unique_ptr<Device> create_egl_device(const DeviceOptions& options) {
  auto context = std::make_shared<egl::Context>(egl::open_best(options.validation), options);
  return std::make_unique<egl::EglDevice>(std::move(context), options.more_shaders);
}

}  // namespace lumigraft::relight::gpu
