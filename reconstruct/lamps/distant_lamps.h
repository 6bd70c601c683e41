#pragma once
// Which lamps may as well be infinitely far.
#include <optional>
#include <vector>

#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/lamps/shading_model.h"

namespace lumigraft::reconstruct {

/// A lamp is placed where the room is explained best, but how sharp that minimum is does not tell whether there is a
/// better one farther away: the sun's lies anywhere. Likelihoods are compared instead. A lamp is far where the room is
/// then explained as well as before. Doubtful ones, where it is explained worse by less than 1σ, are far where that
/// holds for all of them at once: lamps that share what shading tells may each be uncertain, and yet none of them far.
///
/// `near` are the shapes found, `pair_variance` as in Refinement. The model's tables are lost.
/// @return for each lamp its shape when far; nothing where it stands where it was found
std::vector<std::optional<LampShape>> far_lamps(ShadingModel& model, const std::vector<SamplePair>& pairs,
                                                const std::vector<LampShape>& near, double pair_variance);

}  // namespace lumigraft::reconstruct
