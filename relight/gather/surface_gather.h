#pragma once
// Irradiance of the objects' probes and its change in the room's cells, by final gathering (Reichert 1992) with rays
// that end in the previous results: every round adds a bounce.
#include <cstdint>

#include "relight/gather/delta_light.h"

namespace lumigraft::relight {

/// The elements to update, by their number: one of every `of`. The others keep their values, if they have any.
struct UpdateSubset {
  int of = 1, now = 0;
  bool is_of(int place) const { return place % of == now; }
};

/// Direct light of lamps, and of sample points of objects that emit, at the objects' probes. `samples`: per lamp.
void gather_lamps(const DeltaLight& light, int samples, std::uint32_t seed, const UpdateSubset& turn,
                  RayObjects& objects);

/// All other light at the probes. `rays`: over the hemisphere of a probe. Interreflection between and within matt
/// objects is iterated `bounces` times without further rays.
void gather_objects(const DeltaLight& light, int rays, int bounces, std::uint32_t seed, const UpdateSubset& turn,
                    RayObjects& objects);

/// Writes cells.irradiance. `places`: regions where light changes. `rays`: over the hemisphere, and as many towards
/// these regions.
void gather_cells(const DeltaLight& light, const std::vector<ChangeRegion>& places, int rays, std::uint32_t seed,
                  const UpdateSubset& turn, IrradianceChangeCache& cells);

struct RayCounts {
  int hemisphere = 0, aimed = 0;  ///< hemisphere: cosine distributed; aimed: towards regions of changed light
};
/// That change at a white vertex whose regions are set, without sample points of objects that emit, W/m². `place`: seed
/// of its rays. `to_object_m`: lowered to the distance of the nearest object that rays hit; may be null.
Rgb changed_irradiance(const DeltaLight& light, const PathVertex& vertex, const RayCounts& rays, std::uint32_t seed,
                       std::uint32_t place, float* to_object_m);

/// One sample of the change of radiance that a glossy vertex reflects to the viewer, W/sr/m², including lamps.
Rgb changed_radiance(const DeltaLight& light, const PathVertex& vertex, Sampler& sampler, float* to_object_m);

}  // namespace lumigraft::relight
