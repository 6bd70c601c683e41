#pragma once
// Irradiance of the objects' places and its change in the room's cells, by final gathering (Reichert 1992) over rays
// that end in each other's last results: every round is one more bounce.
#include <cstdint>

#include "relight/gather/delta_light.h"

namespace lumigraft::relight {

/// Which places get new light, by their number: one of `of`. The others keep what they have, if they have any.
struct UpdateSubset {
  int of = 1, now = 0;
  bool is_of(int place) const { return place % of == now; }
};

/// What lamps bring to the objects' places. `samples`: of each lamp.
void gather_lamps(const DeltaLight& light, int samples, std::uint32_t seed, const UpdateSubset& turn,
                  RayObjects& objects);

/// All else that comes to them. `rays`: over the hemisphere of a place. Light goes to and fro between matt objects, and
/// within one, `bounces` times without further rays.
void gather_objects(const DeltaLight& light, int rays, int bounces, std::uint32_t seed, const UpdateSubset& turn,
                    RayObjects& objects);

/// Into cells.irradiance. `places`: where light changes. `rays`: over the hemisphere, and as many towards the places.
void gather_cells(const DeltaLight& light, const std::vector<ChangeRegion>& places, int rays, std::uint32_t seed,
                  const UpdateSubset& turn, IrradianceChangeCache& cells);

struct RayCounts {
  int hemisphere = 0, aimed = 0;  ///< by the cosine; towards where light changes
};
/// That change at a white vertex that looks for places, W/m². `place` tells its rays from others'. `to_object_m` gets
/// lower where they meet an object nearer; may be null.
Rgb changed_irradiance(const DeltaLight& light, const PathVertex& vertex, const RayCounts& rays, std::uint32_t seed,
                       std::uint32_t place, float* to_object_m);

/// One sample of the change of radiance that a glossy vertex sends to where it is seen from, W/sr/m², with
/// what lamps bring.
Rgb changed_radiance(const DeltaLight& light, const PathVertex& vertex, Sampler& sampler, float* to_object_m);

}  // namespace lumigraft::relight
