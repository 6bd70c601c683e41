#include "relight/passes/volume/bounce.h"

#include <utility>

#include "relight/passes/parameters.h"
#include "relight/passes/volume/surface_fill.h"

namespace lumigraft::relight {

Bounce::Bounce(gpu::Device& device)
    : cells_(device.create_compute("cell_list.comp")),
      virtual_(device.create_compute("bounce_virtual.comp")),
      real_(device.create_compute("bounce_real.comp")),
      smooth_(device.create_compute("cell_smooth.comp")),
      resolve_(device.create_compute("resolve.comp")),
      mean_(device.create_compute("chunk_mean.comp")),
      enclosure_light_(device.create_compute("enclosure_light.comp")),
      enclosure_change_(device.create_compute("enclosure_change.comp")) {}

void Bounce::list_cells(gpu::CommandList& list, shader::FrameParams params, float min_fraction,
                        const Volumes& volumes) const {
  params.pass_f.x() = min_fraction;
  list.fill(*volumes.cells, 0);
  dispatch_cascades(list, *cells_,
                    {gpu::storage(28, *volumes.cells), gpu::image(1, *volumes.real_radiance), volumes.chunks()}, params,
                    volumes.edge / 2);
}

void Bounce::gather_virtual(gpu::CommandList& list, const shader::FrameParams& params, Slice slice,
                            const LampMaps& maps, const Volumes& volumes) const {
  dispatch_slice(list, *virtual_,
                 joined(joined(volumes.bindings(), maps.bindings()),
                        {gpu::storage(28, *volumes.listed_virtual),
                         gpu::sampled(17, *volumes.virtual_reflectance, gpu::Filter::linear),
                         gpu::image(18, *volumes.gathered_virtual)}),
                 params, slice);
}

void Bounce::gather_real(gpu::CommandList& list, shader::FrameParams params, int change_cones, bool mirrored_lamps,
                         Slice slice, const LampMaps& maps, const gpu::Texture& irradiance,
                         const Volumes& volumes) const {
  params.pass_i.x() = change_cones;
  params.pass_i.y() = mirrored_lamps ? params.counts.w() : 0;
  dispatch_slice(list, *real_,
                 joined(joined(volumes.bindings(), maps.bindings()),
                        {gpu::storage(28, *volumes.cells), gpu::image(18, irradiance),
                         gpu::image(25, *volumes.real_radiance), gpu::image(26, *volumes.real_normal)}),
                 params, slice);
}

void Bounce::smooth_real(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const {
  dispatch_slice(list, *smooth_,
                 {gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear),
                  gpu::sampled(7, *volumes.real_normal, gpu::Filter::linear), gpu::image(8, *volumes.rough_irradiance),
                  gpu::image(18, *volumes.real_irradiance), gpu::storage(28, *volumes.cells), volumes.chunks()},
                 params, {});
}

void Bounce::resolve(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const {
  params.pass_f.x() = 1.0f / SurfaceFill::kUnitsPerFace;
  for (const auto* listed : {&volumes.listed_real, &volumes.listed_virtual}) {  // in both: same value twice
    dispatch_list(list, *resolve_,
                  {gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear), gpu::storage(28, **listed),
                   gpu::storage(15, *volumes.virtual_area), gpu::storage(16, *volumes.virtual_flux),
                   gpu::storage(17, *volumes.real_flux), gpu::image(18, *volumes.gathered_virtual),
                   gpu::sampled(19, *volumes.real_irradiance, gpu::Filter::linear),
                   gpu::image(14, *volumes.real_albedo), gpu::image(25, *volumes.real_radiance),
                   gpu::image(26, *volumes.virtual_radiance), gpu::image(27, *volumes.real_change), volumes.chunks()},
                  params);
  }
}

void Bounce::filter(gpu::CommandList& list, shader::FrameParams params, const ChunkSet& chunks,
                    const gpu::Texture& pool, const Volumes& volumes) const {
  const std::vector<gpu::Binding> bindings{gpu::image(1, pool), gpu::storage(2, chunks.places()), volumes.chunks()};
  for (int level = 1; level < volumes.mips; ++level) {
    if (chunks.count(level) == 0) continue;
    params.pass_i << chunks.first(level), level, static_cast<int>(chunks.kind()), 0;
    list.dispatch(*mean_, bindings, gpu::bytes_of(params), chunks.count(level));
  }
}

void Bounce::light_enclosure(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const {
  params.pass_i.x() = kPasses.enclosure_cones;
  dispatch_2d(list, *enclosure_light_,
              joined(volumes.bindings(),
                     {gpu::image(18, *volumes.enclosure_response), gpu::image(19, *volumes.enclosure_lost)}),
              params, kPasses.enclosure_texels, kPasses.enclosure_texels);
}

void Bounce::change_enclosure(gpu::CommandList& list, shader::FrameParams params, Volumes& volumes) const {
  params.pass_i.x() = kPasses.enclosure_cones;
  dispatch_2d(list, *enclosure_change_,
              joined(volumes.bindings(), {gpu::sampled(12, *volumes.enclosure_response, gpu::Filter::nearest),
                                          gpu::sampled(13, *volumes.enclosure_lost, gpu::Filter::nearest),
                                          gpu::image(18, *volumes.enclosure_change_before)}),
              params, kPasses.enclosure_texels, kPasses.enclosure_texels);
  std::swap(volumes.enclosure_change, volumes.enclosure_change_before);
}

}  // namespace lumigraft::relight
