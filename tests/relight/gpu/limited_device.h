#pragma once
// A device that has no room for some textures, and is a real one in all else.
#include <functional>
#include <memory>

#include "relight/gpu/device.h"

namespace lumigraft::test {

class LimitedDevice : public gpu::Device {
 public:
  using Fits = std::function<bool(const gpu::TextureDesc&)>;
  LimitedDevice(std::shared_ptr<gpu::Device> real, Fits fits) : real_(std::move(real)), fits_(std::move(fits)) {}
  std::string name() const override { return real_->name(); }
  const gpu::Holdings& holdings() const override { return real_->holdings(); }
  std::unique_ptr<gpu::Texture> create_texture(const gpu::TextureDesc& d) override {
    if (!fits_(d)) throw gpu::GpuError("texture \"" + d.name + "\": out of device memory");
    return real_->create_texture(d);
  }
  std::unique_ptr<gpu::Buffer> create_buffer(std::size_t s, std::string_view n) override {
    return real_->create_buffer(s, n);
  }
  std::unique_ptr<gpu::ComputePipeline> create_compute(std::string_view s) override { return real_->create_compute(s); }
  std::unique_ptr<gpu::RasterPipeline> create_raster(const gpu::RasterDesc& d) override {
    return real_->create_raster(d);
  }
  void upload(const gpu::Texture& t, int m, std::span<const std::byte> b) override { real_->upload(t, m, b); }
  void upload(const gpu::Buffer& t, std::size_t o, std::span<const std::byte> b) override { real_->upload(t, o, b); }
  std::vector<std::byte> download(const gpu::Texture& t, int m) override { return real_->download(t, m); }
  std::vector<std::byte> download(const gpu::Buffer& b) override { return real_->download(b); }
  std::unique_ptr<gpu::CommandList> begin() override { return real_->begin(); }
  std::vector<gpu::PassTime> submit(gpu::CommandList& list) override { return real_->submit(list); }

 private:
  std::shared_ptr<gpu::Device> real_;
  Fits fits_;
};

}  // namespace lumigraft::test
