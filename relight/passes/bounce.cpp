#include "relight/passes/bounce.h"

namespace lumigraft {
namespace {

constexpr int kGroups = 512;  // of 64 threads, each of which takes every 32768th voxel of the list

}  // namespace

Bounce::Bounce(gpu::Device& device)
    : list_(device.create_compute("voxel_list.comp")), gather_(device.create_compute("bounce.comp")) {}

void Bounce::list(gpu::CommandList& list, shader::FrameParams params, float least_share, const Volumes& volumes) const {
  params.pass_f.x() = least_share;
  for (int c = 0; c < shader::kCascades; ++c) {
    params.pass_i.x() = c;
    const auto& own = volumes.cascade[static_cast<std::size_t>(c)];
    list.fill(*own.listed, 0);
    dispatch_3d(list, *list_,
                {gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear), gpu::storage(16, *own.listed),
                 gpu::image(25, *own.real_radiance), gpu::image(26, *own.real_albedo)},
                params, volumes.edge, volumes.edge, volumes.edge);
  }
}

void Bounce::gather(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const {
  for (int c = 0; c < shader::kCascades; ++c) {
    params.pass_i.x() = c;
    const auto& own = volumes.cascade[static_cast<std::size_t>(c)];
    list.dispatch(*gather_,
                  joined(volumes.bindings(),
                         {gpu::storage(16, *own.listed), gpu::sampled(17, *volumes.virtual_color, gpu::Filter::linear),
                          gpu::image(18, *own.gathered_virtual), gpu::image(19, *own.gathered_real),
                          gpu::image(25, *own.real_albedo), gpu::image(26, *own.real_normal)}),
                  gpu::bytes_of(params), kGroups);
  }
}

}  // namespace lumigraft
