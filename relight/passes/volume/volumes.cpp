#include "relight/passes/volume/volumes.h"

#include <algorithm>

#include "relight/passes/parameters.h"
#include "relight/upload/light_set.h"
#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

/// The coarsest level has 4³ texels.
int levels_of(int edge_voxels) {
  int levels = 0;
  for (int n = edge_voxels; n >= 4; n /= 2) ++levels;
  return levels;
}

}  // namespace

Volumes::Volumes(gpu::Device& device, int edge_voxels)
    : edge(edge_voxels),
      mips(levels_of(edge)),
      real_chunks(device, Surfaces::real, edge, mips),
      virtual_chunks(device, Surfaces::virt, edge, mips) {
  chunk_table = device.create_buffer(2 * sizeof(std::uint32_t) * chunk_places(edge, mips), "chunks");
  const std::size_t voxels = static_cast<std::size_t>(edge) * edge * edge * shader::kCascades;
  // The fraction of a cube that surfaces fill decreases with its resolution; the constant suffices for the coarsest.
  const std::size_t area = std::min(voxels, 128 * static_cast<std::size_t>(edge) * edge);
  listed_virtual = device.create_buffer(4 * (area / 6 + 4096), "listed virtual voxels");
  listed_real = device.create_buffer(4 * (area / 4 + 4096), "listed real voxels");
  cells = device.create_buffer(4 * (area / 16 + 1024), "listed cells");

  real_distance = device.create_texture(
      gpu::volume_desc("real distance", edge, edge, edge * shader::kCascades, gpu::Format::r16_float));
  real_irradiance = device.create_texture(gpu::volume_desc("irradiance of real", edge / 2, edge / 2,
                                                           edge / 2 * shader::kCascades, gpu::Format::rgba16_float));
  environment = device.create_texture({.name = "environment",
                                       .width = kUpload.environment_px,
                                       .height = kUpload.environment_px,
                                       .mips = kUpload.environment_mips,
                                       .format = gpu::Format::rgba16_float});
  for (auto* texture : {&enclosure_response, &enclosure_lost, &enclosure_change, &enclosure_change_before}) {
    const int edge_px = kPasses.enclosure_texels;
    *texture = device.create_texture(
        {.name = "enclosure", .width = edge_px, .height = edge_px, .format = gpu::Format::rgba16_float});
  }
}

void Volumes::fit_cells(gpu::Device& device, bool smooth) {
  if (!smooth) rough_irradiance.reset();
  if (smooth && !rough_irradiance) rough_irradiance = device.create_texture(real_irradiance->desc());
}

void Volumes::fit_virtual(gpu::Device& device, const Eigen::Vector3i& size) {
  if (virtual_distance && virtual_distance->desc().width == size.x() && virtual_distance->desc().height == size.y() &&
      virtual_distance->desc().depth == size.z()) {
    return;
  }
  virtual_distance.reset();  // free the old one first
  virtual_reflectance.reset();
  virtual_distance =
      device.create_texture(gpu::volume_desc("virtual distance", size.x(), size.y(), size.z(), gpu::Format::r16_float));
  virtual_reflectance = device.create_texture(
      gpu::volume_desc("virtual reflectance", size.x(), size.y(), size.z(), gpu::Format::rgba8_unorm));
}

void Volumes::fit_chunks(gpu::Device& device, Surfaces kind) {
  if (kind == Surfaces::real) {
    real_chunks.number(device, *chunk_table);
    fit_pool(device, "real radiance", real_chunks.all(), &real_radiance);
    fit_pool(device, "real change", real_chunks.all(), &real_change);
    fit_pool(device, "real albedo", real_chunks.finest(), &real_albedo);
    fit_pool(device, "real normal", real_chunks.finest(), &real_normal);
    fit_pool(device, "real response", real_chunks.finest(), &real_response);
    fit_values(device, "real flux", real_chunks.finest(), 3, &real_flux);
  } else {
    virtual_chunks.number(device, *chunk_table);
    fit_pool(device, "virtual radiance", virtual_chunks.all(), &virtual_radiance);
    fit_pool(device, "gathered by virtual", virtual_chunks.finest(), &gathered_virtual);
    fit_values(device, "virtual flux", virtual_chunks.finest(), 3, &virtual_flux);
    fit_values(device, "virtual area", virtual_chunks.finest(), 1, &virtual_area);
  }
}

std::vector<gpu::Binding> Volumes::bindings() const {
  using gpu::Filter;
  return {gpu::sampled(1, *virtual_distance, Filter::linear),
          gpu::sampled(2, *real_distance, Filter::linear),
          gpu::sampled(3, *real_radiance, Filter::linear),
          gpu::sampled(4, *virtual_radiance, Filter::linear),
          gpu::sampled(5, *real_change, Filter::linear),
          gpu::sampled(6, *environment, Filter::linear_mip_linear),
          gpu::sampled(30, *mirror_outlines, Filter::linear),
          gpu::sampled(31, *enclosure_change, Filter::linear),
          chunks(),
          gone()};
}

}  // namespace lumigraft::relight
