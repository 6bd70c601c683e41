#include "relight/passes/screen/live_view.h"

#include "relight/passes/parameters.h"

namespace lumigraft::relight {
namespace {

std::vector<gpu::Binding> inputs(const Volumes& volumes, const gpu::Texture& irradiance, const Screen& screen) {
  using gpu::Filter;
  return {gpu::sampled(2, *volumes.real_distance, Filter::linear),
          gpu::sampled(20, *volumes.real_response, Filter::linear),
          gpu::sampled(21, *volumes.real_normal, Filter::linear),
          gpu::sampled(22, irradiance, Filter::linear),
          volumes.chunks(),
          volumes.gone(),
          gpu::sampled(25, *screen.rays),
          gpu::sampled(26, *screen.depth),
          gpu::sampled(27, *screen.codes)};
}

}  // namespace

LiveView::LiveView(gpu::Device& device)
    : raster_(device.create_raster(vertex_raster("object_lit.vert", "object_lit.frag", {gpu::Format::rgba16_float}))),
      place_(device.create_compute("live_place.comp")),
      gain_(device.create_compute("live_gain.comp")),
      shadow_(device.create_compute("live_shadow.comp")),
      object_(device.create_compute("live_object.comp")),
      blend_(device.create_compute("live_blend.comp")),
      see_gloss_(device.create_compute("live_gloss_view.comp")),
      gloss_(device.create_compute("live_gloss.comp")) {}

void LiveView::draw_objects(gpu::CommandList& list, const shader::FrameParams& params,
                            const std::vector<PlacedObject>& objects, const ObjectLight& light,
                            const gpu::Texture& white, const Screen& screen) const {
  const std::optional<gpu::Area> area = screen.object_area();
  if (!area) return;
  ObjectDraws draws;
  const shader::DrawParams view = camera_view(params, screen.supersampling);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::size_t first = draws.calls.size();
    draws.add(objects[i].stored->simple, objects[i].T_tag_model, objects[i].material, objects[i].white_radiance,
              static_cast<int>(i), view, white);
    for (std::size_t call = first; call < draws.calls.size(); ++call) {
      draws.calls[call].bindings.push_back(gpu::storage(2, light.of(i)));
    }
  }
  list.draw(*raster_, {screen.lit_samples.get()}, *screen.sample_z, draws.calls, &*area);
}

void LiveView::place(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes,
                     const Screen& screen) const {
  dispatch_tiles(list, *place_,
                 joined(inputs(volumes, *volumes.real_irradiance, screen), {gpu::image(12, *screen.real_position)}),
                 params, screen.tiles->objects());
}

void LiveView::compose(gpu::CommandList& list, shader::FrameParams params, const LampShadows& shadows,
                       const LampMaps& maps, bool samples, const Volumes& volumes, const gpu::Texture& irradiance,
                       const Screen& screen) const {
  const std::vector<gpu::Binding> real = inputs(volumes, irradiance, screen);
  const gpu::Binding object = gpu::image(13, *screen.object_layer);
  if (samples) {
    dispatch_tiles(list, *object_,
                   joined(real, {gpu::sampled(11, *screen.lit_samples), object, gpu::image(14, *screen.object_z)}),
                   params, screen.tiles->objects());
  } else {
    dispatch_tiles(list, *blend_,
                   {gpu::sampled(11, *screen.object_radiance), gpu::sampled(14, *screen.object_surface), object,
                    gpu::image(15, *screen.object_z)},
                   params, screen.tiles->objects());
  }
  params.pass_i.x() = screen.fine_step;
  dispatch_tiles(list, *shadow_,
                 joined(joined(real, maps.bindings()),
                        {gpu::sampled(10, shadows.texture(), gpu::Filter::linear), gpu::image(12, *screen.live_gain)}),
                 params, screen.tiles->fine());
  params.pass_i.x() = kPasses.smooth_px;
  dispatch_tiles(list, *gain_, joined(real, {gpu::image(12, *screen.gain)}), params, screen.tiles->smooth());
}

void LiveView::see_gloss(gpu::CommandList& list, const shader::FrameParams& params, const LampShadows& shadows,
                         const LampMaps& maps, const Volumes& volumes, const gpu::Texture& irradiance,
                         const Screen& screen) const {
  dispatch_tiles(list, *see_gloss_,
                 joined(joined(inputs(volumes, irradiance, screen), maps.bindings()),
                        {gpu::sampled(10, shadows.texture(), gpu::Filter::linear), gpu::sampled(23, *screen.radiance),
                         gpu::sampled(28, *screen.known_depth), gpu::image(12, *screen.real_position),
                         gpu::image(13, *screen.real_normal), gpu::image(14, *screen.real_albedo),
                         gpu::image(15, *screen.indirect), gpu::image(17, *screen.mirror_lost),
                         gpu::image(18, *screen.mirror_all)}),
                 params, screen.tiles->glossy());
}

void LiveView::add_gloss(gpu::CommandList& list, shader::FrameParams params, const Screen& screen) const {
  params.pass_i.x() = screen.fine_step;
  dispatch_tiles(
      list, *gloss_,
      {gpu::sampled(2, *screen.radiance), gpu::sampled(4, *screen.real_albedo), gpu::sampled(6, *screen.indirect),
       gpu::sampled(7, *screen.mirror_gained_smooth), gpu::sampled(8, *screen.mirror_fraction_smooth),
       gpu::image(12, *screen.live_gain), gpu::image(13, *screen.object_layer)},
      params, screen.tiles->glossy());
}

}  // namespace lumigraft::relight
