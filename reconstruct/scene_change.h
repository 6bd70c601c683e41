#pragma once
// By how much a field and its albedo differ from earlier ones.
#include "reconstruct/albedo/albedo.h"
#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

/// Share of the field's bricks that are new, or whose mean radiance is another than before by more than kOtherRadiance:
/// what moved, or came to be seen, and not what noise makes drift.
float moved_share(const DistanceField& now, const DistanceField& before);
constexpr float kOtherRadiance = 0.05f;

/// What one more solution told, over surface samples.
struct AlbedoDelta {
  float change = 0;       ///< sum of what albedo changed by over its sum, where both know it
  float newly_known = 0;  ///< share of the samples known now that were not
  float surer = 0;        ///< by how much their standard deviation fell, over what it was; negative: it rose
};
AlbedoDelta compare_albedo(const AlbedoField& now, const AlbedoField& before);

}  // namespace lumigraft::reconstruct
