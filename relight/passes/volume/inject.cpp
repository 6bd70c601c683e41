#include "relight/passes/volume/inject.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumigraft::relight {
namespace {

struct LampView {
  shader::DrawParams draw{};
  float inverse_tan = 1;
  float solid_angle_sr = 0;
};

/// The lamp's view of the sphere around the objects. A lamp inside or near the sphere cannot have all of it in a planar
/// view; the half angle is then limited to 75°.
LampView lamp_view(const shader::FrameParams& frame, const shader::Lamp& lamp) {
  LampView view;
  const Eigen::Vector3f from = lamp.position_radius.head<3>(), to = frame.sphere.head<3>() - from;
  const float far = std::max(to.norm(), 1e-3f), radius = frame.sphere.w();
  const float sine = std::min(radius / far, std::sin(1.3f)), cosine = std::sqrt(1 - sine * sine);
  view.inverse_tan = 0.98f * cosine / sine;  // margin of a few texels
  view.solid_angle_sr = 6.2832f * (1 - cosine);
  view.draw.T_view_tag = view_along(from, to / far);
  view.draw.projection << view.inverse_tan, 0, 0, 0;
  view.draw.more << far + 1.5f * radius, std::max(far - 1.5f * radius, 0.02f * radius), 0, 0;
  return view;
}

/// From m² in the model's frame to m².
float area_scale(const PlacedObject& object) { return object.T_tag_model.linear().col(0).squaredNorm(); }

}  // namespace

Inject::Inject(gpu::Device& device, int map_edge)
    : edge_(map_edge),
      raster_(device.create_raster(vertex_raster(
          "rsm.vert", "rsm.frag", {gpu::Format::rgba32_float, gpu::Format::rgba16_float, gpu::Format::rgba16_float}))),
      inject_(device.create_compute("inject.comp")),
      emit_(device.create_compute("emit.comp")) {
  const auto make = [&](const char* name, gpu::Format format) {
    return device.create_texture({.name = name, .width = edge_, .height = edge_, .format = format, .attachment = true});
  };
  position_ = make("RSM position", gpu::Format::rgba32_float);
  albedo_ = make("RSM albedo", gpu::Format::rgba16_float);
  normal_ = make("RSM normal", gpu::Format::rgba16_float);
  z_ = make("RSM z buffer", gpu::Format::depth32_float);
}

void Inject::choose_unit(const std::vector<PlacedObject>& objects, shader::FrameParams& params) const {
  double max_flux = 1e-6;  // W: all light of all lamps on the objects, in the strongest channel
  for (int i = 0; i < params.counts.x(); ++i) {
    const shader::Lamp& lamp = params.lamps[i];
    max_flux += lamp.intensity.head<3>().maxCoeff() * std::max(lamp.facing.w(), 1.0f) *
                lamp_view(params, lamp).solid_angle_sr * 2.0;
  }
  for (const PlacedObject& object : objects)
    max_flux += std::numbers::pi * object.emission().maxCoeff() * object.stored->area_m2 * area_scale(object) * 2;
  params.field.z() = static_cast<float>(1e9 / max_flux);
  params.field.w() = 1.0f / params.field.z();
}

void Inject::clear(gpu::CommandList& list, const Volumes& volumes) {
  list.fill(*volumes.virtual_flux, 0);
  list.fill(*volumes.real_flux, 0);
}

void Inject::record(gpu::CommandList& list, shader::FrameParams params, int lamp,
                    const std::vector<PlacedObject>& objects, const gpu::Texture& white, const Volumes& volumes) const {
  const LampView view = lamp_view(params, params.lamps[lamp]);
  ObjectDraws draws;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    draws.add(objects[i].stored->simple, objects[i].T_tag_model, objects[i].material, objects[i].white_radiance,
              static_cast<int>(i), view.draw, white);
  }
  list.draw(*raster_, {position_.get(), albedo_.get(), normal_.get()}, *z_, draws.calls);

  params.pass_i.x() = lamp;
  params.pass_f.x() = view.inverse_tan;
  dispatch_2d(
      list, *inject_,
      joined(volumes.bindings(), {gpu::sampled(12, *position_), gpu::sampled(13, *albedo_), gpu::sampled(18, *normal_),
                                  gpu::sampled(14, *volumes.real_albedo, gpu::Filter::linear),
                                  gpu::storage(16, *volumes.virtual_flux), gpu::storage(17, *volumes.real_flux)}),
      params, edge_, edge_);
}

void Inject::record_emission(gpu::CommandList& list, shader::FrameParams params,
                             const std::vector<PlacedObject>& objects, const Volumes& volumes) const {
  for (const PlacedObject& object : objects) {
    if (!object.emits()) continue;
    const bool own = !object.material.emission;
    const Eigen::Vector3f factor = own ? Eigen::Vector3f::Constant(object.white_radiance).eval() : object.emission();
    params.pass_m = object.T_tag_model.matrix();
    params.pass_f << factor, area_scale(object);
    params.pass_i.x() = object.stored->sample_count;
    params.pass_i.y() = own ? 0 : 1;
    dispatch_list(
        list, *emit_,
        {gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear), gpu::storage(16, *volumes.virtual_flux),
         gpu::storage(17, *object.stored->samples), volumes.chunks()},
        params);
  }
}

}  // namespace lumigraft::relight
