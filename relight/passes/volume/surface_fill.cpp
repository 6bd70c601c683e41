#include "relight/passes/volume/surface_fill.h"

#include <array>

#include "relight/exhibit/bsdf_params.h"

namespace lumigraft::relight {

SurfaceFill::SurfaceFill(gpu::Device& device)
    : real_distances_(device.create_compute("real_fill.comp")),
      real_list_(device.create_compute("voxel_list_real.comp")),
      surfaces_(device.create_compute("real_surface.comp")),
      virtual_distances_(device.create_compute("virtual_fill.comp")),
      virtual_list_(device.create_compute("voxel_list_virtual.comp")),
      areas_(device.create_compute("area.comp")) {}

void SurfaceFill::real_distances(gpu::CommandList& list, shader::FrameParams params, Slice slice,
                                 const BrickPool& bricks, const Volumes& volumes) const {
  const int layers = volumes.edge * shader::kCascades;
  const int first = layers * slice.number / slice.of, last = layers * (slice.number + 1) / slice.of;
  params.pass_i.w() = first;
  dispatch_3d(list, *real_distances_, joined(bricks.distance_bindings(), {gpu::image(1, *volumes.real_distance)}),
              params, volumes.edge, volumes.edge, last - first);
  const gpu::Buffer& marks = volumes.real_chunks.marks();
  if (slice.number == 0) {
    list.fill(*volumes.listed_real, 0);
    list.fill(marks, 0);
  }
  dispatch_3d(list, *real_list_,
              {gpu::storage(28, *volumes.listed_real), gpu::storage(33, marks), gpu::image(12, *volumes.real_distance)},
              params, volumes.edge, volumes.edge, last - first);
}

void SurfaceFill::real_surfaces(gpu::CommandList& list, const shader::FrameParams& params, Slice slice,
                                const BrickPool& bricks, const Volumes& volumes) const {
  if (slice.number == 0) {
    for (const auto* texture :
         {&volumes.real_radiance, &volumes.real_albedo, &volumes.real_normal, &volumes.real_response})
      list.clear(**texture, {});
  }
  dispatch_slice(list, *surfaces_,
                 joined(bricks.bindings(),
                        {gpu::storage(28, *volumes.listed_real), gpu::image(1, *volumes.real_distance),
                         gpu::image(2, *volumes.real_radiance), gpu::image(3, *volumes.real_albedo),
                         gpu::image(4, *volumes.real_normal), gpu::image(5, *volumes.real_response), volumes.chunks()}),
                 params, slice);
}

void SurfaceFill::virtual_distances(gpu::Device& device, gpu::CommandList& list, shader::FrameParams params,
                                    const std::vector<PlacedObject>& objects, const Volumes& volumes) {
  while (places_.size() < objects.size()) {
    places_.push_back(device.create_buffer(5 * sizeof(shader::vec4), "object's place"));
  }
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const PlacedObject& object = objects[i];
    const Eigen::Matrix4f T_model_tag = object.T_tag_model.inverse().matrix();
    std::array<shader::vec4, 5> place;
    for (int row = 0; row < 3; ++row) place[static_cast<std::size_t>(row)] = T_model_tag.row(row).transpose();
    const StoredModel::Grid& grid = object.stored->grid();
    place[3] << grid.origin_m, grid.voxel_m;
    place[4] << object.T_tag_model.linear().col(0).norm(), 0, 0, 0;
    device.upload(*places_[i], 0, std::as_bytes(std::span(place)));

    params.pass_i.x() = i == 0 ? 1 : 0;
    params.pass_f.setZero();
    // The texture contains the reflectance of the model's own materials. An override of the base colour or of
    // transmission replaces it; parameters that are not overridden are taken from the first part.
    if (object.material.base_color || object.material.transmission) {
      const Material one = object.material.over(object.stored->model->parts.front().material);
      params.pass_f << reflectance_evenly(bsdf_params_of(one.base_color, one)).matrix(), 1;
    }
    dispatch_3d(list, *virtual_distances_,
                {gpu::sampled(1, *grid.distance, gpu::Filter::linear),
                 gpu::sampled(2, *grid.reflectance, gpu::Filter::linear), gpu::image(3, *volumes.virtual_distance),
                 gpu::image(4, *volumes.virtual_reflectance), gpu::storage(5, *places_[i])},
                params, params.grid.y(), params.grid.z(), params.grid.w());
  }
  const gpu::Buffer& marks = volumes.virtual_chunks.marks();
  list.fill(*volumes.listed_virtual, 0);
  list.fill(marks, 0);
  dispatch_cascades(list, *virtual_list_,
                    {gpu::storage(28, *volumes.listed_virtual), gpu::storage(33, marks),
                     gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear)},
                    params, volumes.edge);
}

void SurfaceFill::virtual_areas(gpu::CommandList& list, shader::FrameParams params,
                                const std::vector<PlacedObject>& objects, const Volumes& volumes) const {
  list.fill(*volumes.virtual_area, 0);
  for (const PlacedObject& object : objects) {
    const float scale = object.T_tag_model.linear().col(0).norm();
    params.pass_m = object.T_tag_model.matrix();
    params.pass_f.x() = kUnitsPerFace * scale * scale;
    params.pass_i.x() = object.stored->sample_count;
    dispatch_list(
        list, *areas_,
        {gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear), gpu::storage(16, *object.stored->samples),
         gpu::storage(17, *volumes.virtual_area), volumes.chunks()},
        params);
  }
}

}  // namespace lumigraft::relight
