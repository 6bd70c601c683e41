#pragma once
// Detection of lamps that are as good as infinitely far.
#include <optional>
#include <vector>

#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/lamps/shading_model.h"

namespace lumigraft::reconstruct {

/// The sharpness of the minimum at a lamp's distance does not show whether a larger distance fits better: the minimum
/// of the sun may be anywhere. So likelihoods are compared. A lamp is distant if the room is then explained as well.
/// Doubtful lamps, with which it is explained worse by less than 1σ, are distant if that holds for all of them at once:
/// lamps that share the evidence may each be uncertain although they cannot all be distant.
///
/// `near` are the estimated shapes, `pair_variance` as in Refinement. Overwrites the model's visibility tables.
/// @return for each lamp its shape if distant
std::vector<std::optional<LampShape>> find_distant_lamps(ShadingModel& model, const std::vector<SamplePair>& pairs,
                                                         const std::vector<LampShape>& near, double pair_variance);

}  // namespace lumigraft::reconstruct
