#pragma once
// A real device that fails to allocate some textures.
#include <functional>
#include <memory>

#include "relight/gpu/device.h"

namespace lumigraft::test {

class LimitedDevice : public relight::gpu::Device {
 public:
  using Fits = std::function<bool(const relight::gpu::TextureDesc&)>;
  LimitedDevice(std::shared_ptr<relight::gpu::Device> real, Fits fits)
      : real_(std::move(real)), fits_(std::move(fits)) {}
  std::string name() const override { return real_->name(); }
  bool is_software() const override { return real_->is_software(); }
  const relight::gpu::Holdings& holdings() const override { return real_->holdings(); }
  std::unique_ptr<relight::gpu::Texture> create_texture(const relight::gpu::TextureDesc& d) override {
    if (!fits_(d)) throw relight::gpu::GpuError("texture \"" + d.name + "\": out of device memory");
    return real_->create_texture(d);
  }
  std::unique_ptr<relight::gpu::Buffer> create_buffer(std::size_t s, std::string_view n) override {
    return real_->create_buffer(s, n);
  }
  std::unique_ptr<relight::gpu::ComputePipeline> create_compute(std::string_view s) override {
    return real_->create_compute(s);
  }
  std::unique_ptr<relight::gpu::RasterPipeline> create_raster(const relight::gpu::RasterDesc& d) override {
    return real_->create_raster(d);
  }
  void upload(const relight::gpu::Texture& t, int m, std::span<const std::byte> b) override { real_->upload(t, m, b); }
  void upload_rgb(const relight::gpu::Texture& t, std::span<const std::uint8_t> b) override { real_->upload_rgb(t, b); }
  void upload(const relight::gpu::Buffer& t, std::size_t o, std::span<const std::byte> b) override {
    real_->upload(t, o, b);
  }
  std::vector<std::byte> download(const relight::gpu::Texture& t, int m) override { return real_->download(t, m); }
  std::vector<std::byte> download(const relight::gpu::Buffer& b) override { return real_->download(b); }
  std::vector<std::vector<std::byte>> download(std::span<const relight::gpu::TexturePart> p) override {
    return real_->download(p);
  }
  std::unique_ptr<relight::gpu::CommandList> begin() override { return real_->begin(); }
  std::vector<relight::gpu::PassTime> submit(relight::gpu::CommandList& list) override { return real_->submit(list); }

 private:
  std::shared_ptr<relight::gpu::Device> real_;
  Fits fits_;
};

}  // namespace lumigraft::test
