#include "relight/light_volume_builder.h"

#include <algorithm>

#include "relight/parameters.h"
#include "relight/quality.h"

namespace lumigraft::relight {
LightVolumeBuilder::LightVolumeBuilder(gpu::Device& device)
    : device_(device), fill_(device), bounce_(device), object_light_(device) {}

void LightVolumeBuilder::fit(const Plan& plan) {
  if (rsm_ != plan.rsm) inject_ = std::make_unique<Inject>(device_, plan.rsm);
  rsm_ = plan.rsm;
  if (plan.method == "dlpv") {
    if (!lpv_) lpv_ = std::make_unique<Lpv>(device_);
    lpv_->fit(device_, plan.volume, plan.lpv_steps);
  } else {
    lpv_.reset();
  }
}

std::vector<LightStep> LightVolumeBuilder::steps(const Work& work, const BrickPool& bricks, const gpu::Texture& white,
                                                 LightVolumeState& room) {
  std::vector<LightStep> steps;
  Volumes& volumes = room.volumes;
  const Quality quality = quality_of(work.key.plan);
  const bool surfaces = !room.real || !(*room.real == work.key.real());
  add_chunks(work, bricks, surfaces, room, &steps);
  if (surfaces) add_surfaces(work, bricks, room, &steps);
  steps.push_back({"volumes", 20, [this, work, &volumes](gpu::CommandList& list) {
                     fill_.virtual_areas(list, work.params, work.key.objects, volumes);
                     // Objects that emit change surfaces of which they cover less.
                     const float brighter = 1 + work.params.exposure.w() / kRelight.dim_pixel;
                     bounce_.list_cells(list, work.params, kRelight.min_hemisphere / brighter, volumes);
                   }});
  steps.push_back({"inject", 5, [&volumes](gpu::CommandList& list) {
                     // The first resolve must not use bounces under other lamps.
                     for (const auto* texture :
                          {&volumes.gathered_virtual, &volumes.real_irradiance, &volumes.rough_irradiance,
                           &volumes.virtual_radiance, &volumes.real_change, &volumes.enclosure_change,
                           &volumes.enclosure_change_before}) {
                       if (*texture) list.clear(**texture, {});
                     }
                     Inject::clear(list, volumes);
                   }});
  for (int lamp = 0; lamp < work.params.counts.x(); ++lamp) {
    steps.push_back({"inject", 40, [this, work, lamp, &white, &volumes](gpu::CommandList& list) {
                       inject_->record(list, work.params, lamp, work.key.objects, white, volumes);
                     }});
  }
  if (std::ranges::any_of(work.key.objects, &PlacedObject::emits)) {
    steps.push_back({"inject", 5, [this, work, &volumes](gpu::CommandList& list) {
                       inject_->record_emission(list, work.params, work.key.objects, volumes);
                     }});
  }
  add_resolve(work, room, &steps);
  Work coarse = work;
  coarse.params.counts.y() = coarse.params.counts.z() = quality.voxel_cones;
  if (work.key.enclosure) {
    steps.push_back({"enclosure", 40, [this, coarse, &volumes](gpu::CommandList& list) {
                       bounce_.light_enclosure(list, coarse.params, volumes);
                     }});
  }
  for (int i = 1; i < work.key.plan.bounces; ++i) {
    for (int slice = 0; slice < work.slices; ++slice) {
      steps.push_back({"bounce of virtual", 90.0f / static_cast<float>(work.slices),
                       [this, coarse, slice, &volumes](gpu::CommandList& list) {
                         bounce_.gather_virtual(list, coarse.params, {slice, coarse.slices}, *coarse.maps, volumes);
                       }});
    }
    // Propagation adds the light gathered at virtual surfaces itself: it must not be resolved together with it before.
    if (work.key.enclosure && !quality.cells && !lpv_) {
      add_resolve(work, room, &steps);
      add_enclosure_change(coarse, room, &steps);
    }
    add_real_gather(coarse, room, "bounce of real", i - 1, &steps);
    add_resolve(work, room, &steps);
  }
  if (work.key.enclosure) add_enclosure_change(coarse, room, &steps);
  room.gathered.objects.clear();
  if (quality.cells || lpv_) add_real_gather(coarse, room, "cells", work.key.plan.bounces - 1, &steps);
  if (work.live && ObjectLight::enough_for(work.key.objects)) {
    room.gathered.objects = work.key.objects;
    ObjectLight::fit(device_, work.key.objects, &room.gathered.light);
    for (int slice = 0; slice < work.slices; ++slice) {
      steps.push_back(
          {"object light", 90.0f / static_cast<float>(work.slices), [this, work, slice, &room](gpu::CommandList& list) {
             object_light_.gather(list, work.params, kRelight.vertex_cones, {slice, work.slices}, work.key.objects,
                                  *work.maps, room.volumes, room.gathered.light);
           }});
    }
  }
  return steps;
}

/// Finds the surfaces and allocates storage for their data.
void LightVolumeBuilder::add_chunks(const Work& work, const BrickPool& bricks, bool real, LightVolumeState& room,
                                    std::vector<LightStep>* steps) {
  Volumes& volumes = room.volumes;
  // A slice has whole groups of two layers.
  const int slices = std::min(work.slices, volumes.edge);
  for (int slice = 0; real && slice < slices; ++slice) {
    steps->push_back({"volumes", 60.0f / static_cast<float>(slices),
                      [this, work, slice, slices, &bricks, &volumes](gpu::CommandList& list) {
                        fill_.real_distances(list, work.params, {slice, slices}, bricks, volumes);
                      }});
  }
  steps->push_back({"volumes", 20, [this, work, &volumes](gpu::CommandList& list) {
                      fill_.virtual_distances(device_, list, work.params, work.key.objects, volumes);
                    }});
  steps->push_back({"volumes", 0, {}, [this, real, &volumes] {
                      if (real) volumes.fit_chunks(device_, Surfaces::real);
                      volumes.fit_chunks(device_, Surfaces::virt);
                    }});
}

void LightVolumeBuilder::add_surfaces(const Work& work, const BrickPool& bricks, LightVolumeState& room,
                                      std::vector<LightStep>* steps) {
  const Volumes& volumes = room.volumes;
  for (int slice = 0; slice < work.slices; ++slice) {
    steps->push_back({"volumes", 80.0f / static_cast<float>(work.slices),
                      [this, work, slice, &bricks, &volumes](gpu::CommandList& list) {
                        fill_.real_surfaces(list, work.params, {slice, work.slices}, bricks, volumes);
                      }});
  }
  steps->push_back({"volumes", 20, [this, work, &volumes](gpu::CommandList& list) {
                      bounce_.filter(list, work.params, volumes.real_chunks, *volumes.real_radiance, volumes);
                    }});
}

void LightVolumeBuilder::add_resolve(const Work& work, const LightVolumeState& room, std::vector<LightStep>* steps) {
  const Volumes& volumes = room.volumes;
  steps->push_back(
      {"resolve", 20, [this, work, &volumes](gpu::CommandList& list) { bounce_.resolve(list, work.params, volumes); }});
  steps->push_back({"resolve", 20, [this, work, &volumes](gpu::CommandList& list) {
                      bounce_.filter(list, work.params, volumes.virtual_chunks, *volumes.virtual_radiance, volumes);
                      bounce_.filter(list, work.params, volumes.real_chunks, *volumes.real_change, volumes);
                    }});
}

void LightVolumeBuilder::add_enclosure_change(const Work& work, LightVolumeState& room, std::vector<LightStep>* steps) {
  steps->push_back({"enclosure", 40, [this, work, &room](gpu::CommandList& list) {
                      bounce_.change_enclosure(list, work.params, room.volumes);
                    }});
}

void LightVolumeBuilder::add_real_gather(const Work& work, const LightVolumeState& room, const char* pass, int round,
                                         std::vector<LightStep>* steps) {
  const Volumes& volumes = room.volumes;
  if (lpv_) {
    steps->push_back({pass, 200, [this, work, round, &volumes](gpu::CommandList& list) {
                        lpv_->gather_real(list, work.params, work.brightest, round, work.key.plan.bounces, volumes);
                      }});
    return;
  }
  const bool last = round + 1 == work.key.plan.bounces;
  const gpu::Texture& irradiance = last ? *volumes.rough_irradiance : *volumes.real_irradiance;
  for (int slice = 0; slice < work.slices; ++slice) {
    steps->push_back({pass, 110.0f / static_cast<float>(work.slices),
                      [this, work, last, slice, &irradiance, &volumes](gpu::CommandList& list) {
                        bounce_.gather_real(list, work.params, kRelight.change_cones, !last || work.live,
                                            {slice, work.slices}, *work.maps, irradiance, volumes);
                      }});
  }
  if (last) {
    steps->push_back({pass, 10, [this, work, &volumes](gpu::CommandList& list) {
                        bounce_.smooth_real(list, work.params, volumes);
                      }});
  }
}

}  // namespace lumigraft::relight
