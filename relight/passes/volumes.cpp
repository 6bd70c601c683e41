#include "relight/passes/volumes.h"

#include "relight/light_set.h"

namespace lumigraft {
namespace {

gpu::TextureDesc volume(const char* name, int x, int y, int z, gpu::Format format, int mips = 1) {
  return {.name = name, .width = x, .height = y, .depth = z, .volume = true, .mips = mips, .format = format};
}

}  // namespace

Volumes::Volumes(gpu::Device& device, int edge_voxels) : edge(edge_voxels) {
  for (int n = edge; n >= 4; n /= 2) ++mips;  // coarser than 4³ nothing is asked for
  // Buffers first: some devices hold textures of a size for which they have no buffer.
  const std::size_t voxels = static_cast<std::size_t>(edge) * edge * edge * shader::kCascades;
  virtual_flux = device.create_buffer(voxels * 3 * sizeof(int), "virtual flux");
  real_flux = device.create_buffer(voxels * 3 * sizeof(int), "real flux");
  virtual_area = device.create_buffer(voxels * sizeof(int), "virtual area");
  // Surfaces fill a small part of a cube; the constant is room enough for the smallest.
  listed_virtual = device.create_buffer(4 * (voxels / 6 + 4096), "listed virtual voxels");
  listed_real = device.create_buffer(4 * (voxels / 4 + 4096), "listed real voxels");
  cells = device.create_buffer(4 * (voxels / 16 + 1024), "listed cells");

  const auto make = [&](const char* name, gpu::Format format, int levels) {
    return device.create_texture(volume(name, edge, edge, edge * shader::kCascades, format, levels));
  };
  real_distance = make("real distance", gpu::Format::r16_float, 1);
  real_albedo = make("real albedo", gpu::Format::rgba16_float, 1);
  real_normal = make("real normal", gpu::Format::rgba16_float, 1);
  real_response = make("real response", gpu::Format::rgba16_float, 1);
  real_radiance = make("real radiance", gpu::Format::rgba16_float, mips);
  virtual_radiance = make("virtual radiance", gpu::Format::rgba16_float, mips);
  real_change = make("real change", gpu::Format::rgba16_float, mips);
  gathered_virtual = make("gathered by virtual", gpu::Format::rgba16_float, 1);
  real_irradiance = device.create_texture(
      volume("irradiance of real", edge / 2, edge / 2, edge / 2 * shader::kCascades, gpu::Format::rgba16_float));
  rough_irradiance = device.create_texture(real_irradiance->desc());
  environment = device.create_texture({.name = "environment",
                                       .width = kEnvironmentEdge,
                                       .height = kEnvironmentEdge,
                                       .mips = kEnvironmentMips,
                                       .format = gpu::Format::rgba16_float});
  for (auto* texture : {&enclosure_response, &enclosure_lost, &enclosure_change, &enclosure_change_before}) {
    *texture = device.create_texture(
        {.name = "enclosure", .width = kEnclosureEdge, .height = kEnclosureEdge, .format = gpu::Format::rgba16_float});
  }
}

void Volumes::fit_virtual(gpu::Device& device, const Eigen::Vector3i& size) {
  if (virtual_distance && virtual_distance->desc().width == size.x() && virtual_distance->desc().height == size.y() &&
      virtual_distance->desc().depth == size.z()) {
    return;
  }
  virtual_distance =
      device.create_texture(volume("virtual distance", size.x(), size.y(), size.z(), gpu::Format::r16_float));
  virtual_color =
      device.create_texture(volume("virtual colour", size.x(), size.y(), size.z(), gpu::Format::rgba8_unorm));
}

std::vector<gpu::Binding> Volumes::bindings() const {
  using gpu::Filter;
  return {gpu::sampled(1, *virtual_distance, Filter::linear),
          gpu::sampled(2, *real_distance, Filter::linear),
          gpu::sampled(3, *real_radiance, Filter::linear_mip_linear),
          gpu::sampled(4, *virtual_radiance, Filter::linear_mip_linear),
          gpu::sampled(5, *real_change, Filter::linear_mip_linear),
          gpu::sampled(6, *environment, Filter::linear_mip_linear),
          gpu::sampled(30, *mirror_outlines, Filter::linear),
          gpu::sampled(31, *enclosure_change, Filter::linear)};
}

}  // namespace lumigraft
