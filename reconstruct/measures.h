#pragma once
// What a planner can know of a scene before it draws: how much there is of what costs work.
#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "reconstruct/albedo.h"
#include "reconstruct/distance_field.h"
#include "reconstruct/enclosure.h"
#include "reconstruct/gloss.h"
#include "reconstruct/light.h"

namespace lumigraft {

struct LightMeasures {
  std::vector<float> lamp_share;  ///< by lamp, in the order of the illumination: of all light at the probe, ∫L dω
  float remainder_share = 0;      ///< the rest of it
  std::array<float, 3>
      band_share{};  ///< by band of the harmonics: of the remainder's irradiance squared, over all normals
  /// By the last band kept: root of the mean squared irradiance of the higher ones, over the mean irradiance of all
  /// light, lamps too; both over all normals.
  std::array<float, 3> bands_left_out{};
};

LightMeasures measure_light(const Illumination& light);

/// Of the surface within a radius around a place.
struct SurfaceMeasures {
  int points = 0;             ///< each of about four by four voxels; where there are few, the others say little
  float curvature_per_m = 0;  ///< median turn of the normal over a way along the surface: 1/R of a ball, 0 of a plane
  float clutter = 0;          ///< share of the points that are not on the largest plane
};

SurfaceMeasures measure_surface(const std::vector<RoomPoint>& points, const Eigen::Vector3f& place_m, float radius_m);

/// Share of the field's bricks that are not those of an earlier field: new space, and where something moved.
float changed_share(const DistanceField& now, const DistanceField& before);

/// Share of the field's bricks that are new, or whose mean radiance is another than before by more than kOtherRadiance:
/// what moved, or came to be seen, and not what noise makes drift.
float moved_share(const DistanceField& now, const DistanceField& before);
constexpr float kOtherRadiance = 0.05f;

/// What one more solution told, over surface samples.
struct AlbedoNews {
  float change = 0;       ///< sum of what albedo changed by over its sum, where both know it
  float newly_known = 0;  ///< share of the samples known now that were not
  float surer = 0;        ///< by how much their standard deviation fell, over what it was; negative: it rose
};
AlbedoNews compare_albedo(const AlbedoField& now, const AlbedoField& before);

struct SceneMeasures {
  LightMeasures light;
  std::vector<RoomPoint> surface;  ///< for measure_surface around an object
  float glossy_share = 0;          ///< of the surface: known to be glossy or a mirror
  float gloss_known_share = 0;     ///< known at all
};

/// `surface` are the field's points (room_points); `gloss` may be null.
SceneMeasures measure_scene(const Illumination& light, std::vector<RoomPoint> surface, const GlossField* gloss);

}  // namespace lumigraft
