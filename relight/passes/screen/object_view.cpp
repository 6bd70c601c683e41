#include "relight/passes/screen/object_view.h"

#include "relight/upload/transmittance.h"

namespace lumigraft::relight {
namespace {

std::vector<gpu::Binding> shading_inputs(const Volumes& volumes, const Screen& screen) {
  return joined(volumes.bindings(), {gpu::sampled(12, *screen.object_normal), gpu::sampled(13, *screen.object_base),
                                     gpu::sampled(14, *screen.object_surface), gpu::sampled(15, *screen.rays)});
}

}  // namespace

shader::DrawParams camera_view(const shader::FrameParams& frame, int samples) {
  shader::DrawParams view{};
  const float s = static_cast<float>(samples), shift = 0.5f * (s - 1);  // pixel centres are unchanged
  view.T_view_tag = frame.T_camera_tag;
  view.projection << s * frame.pinhole.x(), s * frame.pinhole.y(), s * frame.pinhole.z() + shift,
      s * frame.pinhole.w() + shift;
  view.distortion = frame.distortion;
  view.lens = frame.lens;
  view.more << frame.camera.x(), frame.camera.y(), s * static_cast<float>(frame.picture.x()),
      s * static_cast<float>(frame.picture.y());
  return view;
}

ObjectView::ObjectView(gpu::Device& device)
    : raster_(device.create_raster(vertex_raster(
          "object.vert", "object.frag",
          {gpu::Format::rgba16_float, gpu::Format::rgba16_float, gpu::Format::rg32_float, gpu::Format::rgba16_float}))),
      raster_known_(device.create_raster(
          vertex_raster("object.vert", "known.frag",
                        {gpu::Format::rgba16_float, gpu::Format::rgba16_float, gpu::Format::rg32_float}))),
      resolve_(device.create_compute("object_resolve.comp")),
      ambient_(device.create_compute("ambient.comp")),
      shade_(device.create_compute("shade.comp")) {}

void ObjectView::draw(gpu::CommandList& list, const shader::FrameParams& params,
                      const std::vector<PlacedObject>& objects, bool simple, const gpu::Texture& white,
                      const Screen& screen) const {
  ObjectDraws draws;
  const shader::DrawParams view = camera_view(params, screen.supersampling);
  const std::vector<int> glass = glass_numbers(objects);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const auto& mesh = simple ? objects[i].stored->simple : objects[i].stored->full;
    draws.add(mesh, objects[i].T_tag_model, objects[i].material, objects[i].white_radiance, static_cast<int>(i), view,
              white, glass[i]);
  }
  list.draw(
      *raster_,
      {screen.sample_normal.get(), screen.sample_base.get(), screen.sample_depth.get(), screen.sample_emission.get()},
      *screen.sample_z, draws.calls);
}

void ObjectView::draw_known(gpu::CommandList& list, const shader::FrameParams& params,
                            const std::vector<StoredModel::Mesh>& surfaces, const gpu::Texture& white,
                            const Screen& screen) const {
  ObjectDraws draws;
  const shader::DrawParams view = camera_view(params, 1);
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    draws.add(surfaces[i], Eigen::Affine3f::Identity(), Material{.specular = 0}, 1, static_cast<int>(i), view, white);
  }
  list.draw(*raster_known_, {screen.known_normal.get(), screen.known_base.get(), screen.known_depth.get()},
            *screen.known_z, draws.calls);
}

void ObjectView::resolve(gpu::CommandList& list, const shader::FrameParams& params, const Screen& screen) const {
  dispatch_tiles(
      list, *resolve_,
      {gpu::sampled(1, *screen.sample_normal), gpu::sampled(2, *screen.sample_base),
       gpu::sampled(3, *screen.sample_depth), gpu::sampled(4, *screen.real_position), gpu::sampled(5, *screen.rays),
       gpu::sampled(6, *screen.depth), gpu::sampled(7, *screen.sample_emission), gpu::image(12, *screen.object_normal),
       gpu::image(13, *screen.object_base), gpu::image(14, *screen.object_surface),
       gpu::image(15, *screen.object_other), gpu::image(16, *screen.object_emission)},
      params, screen.tiles->objects());
}

void ObjectView::ambient(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes,
                         const Screen& screen) const {
  params.pass_i.x() = screen.ambient_scale;
  dispatch_tiles(list, *ambient_,
                 joined(shading_inputs(volumes, screen),
                        {gpu::image(16, *screen.object_irradiance), gpu::image(17, *screen.object_mirrored),
                         gpu::image(18, *screen.object_open)}),
                 params, screen.tiles->ambients());
}

void ObjectView::shade(gpu::CommandList& list, shader::FrameParams params, const LampMaps& maps, const Volumes& volumes,
                       const Screen& screen) const {
  params.pass_i.x() = screen.ambient_scale;
  dispatch_tiles(list, *shade_,
                 joined(joined(shading_inputs(volumes, screen), maps.bindings()),
                        {gpu::sampled(17, *screen.object_irradiance), gpu::sampled(18, *screen.object_mirrored),
                         gpu::sampled(19, *screen.object_open), gpu::image(20, *screen.object_emission),
                         gpu::image(16, *screen.object_radiance)}),
                 params, screen.tiles->objects());
}

}  // namespace lumigraft::relight
