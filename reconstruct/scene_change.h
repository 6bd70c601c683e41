#pragma once
// Measures by how much a field and its albedo differ from earlier ones.
#include "reconstruct/albedo/albedo.h"
#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

/// Fraction of the field's bricks that are new, or whose mean radiance changed by more than kOtherRadiance: moved or
/// newly seen surfaces, but not drift caused by noise.
float moved_fraction(const DistanceField& now, const DistanceField& before);
constexpr float kOtherRadiance = 0.05f;

/// Difference of two successive solutions, over surface samples.
struct AlbedoDelta {
  float change = 0;       ///< sum of absolute changes over the sum of albedo, where both are known
  float newly_known = 0;  ///< fraction of the known samples that were unknown before
  float surer = 0;        ///< relative decrease of their standard deviation; negative: an increase
};
AlbedoDelta compare_albedo(const AlbedoField& now, const AlbedoField& before);

}  // namespace lumigraft::reconstruct
