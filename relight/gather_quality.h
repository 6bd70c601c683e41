#pragma once
// Sampling densities of final gathering, chosen by the plan's trace_scale.

namespace lumigraft::relight {

struct GatherQuality {
  int room = 1;           ///< real surfaces are traced for one per square of so many pixels; `gather` counts these
  int gather = 2;         ///< indirect light is gathered for one pixel per square of this edge, pixels
  int on_object = 1;      ///< edge of the pixel squares of objects that share lamp shadows
  int step = 2;           ///< spacing of the first shadow samples: pixels, or squares of on_object
  int lamp_rays = 16;     ///< per such place and lamp
  bool sparse = false;    ///< where penumbrae are wide, sample one of 2 × 2 places
  int inside = 4;         ///< rays per pixel in the interior of an object
  int at_edges = 16;      ///< rays per pixel at its edge
  int mirrored = 4;       ///< reflected rays of a glossy object per interior ray
  int mirror_rounds = 8;  ///< up to so many times as many where they are noisier than a step of an 8-bit picture
  int photons = 1 << 17;  ///< from lamps to transmissive objects and smooth metals
  int rounds = 1;         ///< frames over which all camera-independent light is updated while things move

  bool operator==(const GatherQuality&) const = default;
};

inline GatherQuality gather_quality_of(int trace_scale) {
  GatherQuality live{.room = 2,
                     .gather = 4,
                     .on_object = 4,
                     .step = 2,
                     .lamp_rays = 8,
                     .sparse = true,
                     .inside = 1,
                     .at_edges = 4,
                     .mirrored = 2,
                     .mirror_rounds = 1,
                     .photons = 1 << 14,
                     .rounds = 8};
  switch (trace_scale) {
    case 16:
      live.room = 4;
      return live;
    case 8:
      return live;
    case 4:
      return {.gather = 4,
              .on_object = 2,
              .step = 4,
              .sparse = true,
              .inside = 1,
              .at_edges = 8,
              .mirror_rounds = 1,
              .photons = 1 << 15,
              .rounds = 8};
    default:
      return {.gather = trace_scale};
  }
}

}  // namespace lumigraft::relight
