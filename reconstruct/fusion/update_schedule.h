#pragma once
// Which bricks of a frame are updated: work follows information, and is bounded.
#include <cstdint>
#include <vector>

#include "reconstruct/fusion/brick_selection.h"
#include "reconstruct/fusion/working_brick.h"

namespace lumigraft::reconstruct {

struct VisibleBrick {
  WorkingBrick* brick;
  BrickVisibility visibility;
};

/// Whether an update, the first from this frame, would add enough information to what the brick has, or its content or
/// light changed. An update adds about 1/n of what n updates gave, so the interval grows with n.
bool update_due(const WorkingBrick& brick, std::uint32_t frame, double light_variance);

/// Keeps the bricks that one call may update: at most `max_bricks`, those that gain most and are near first. The order
/// of those kept stays. False if all are kept.
bool limit_work(std::vector<VisibleBrick>& bricks, std::uint32_t frame, double light_variance, std::size_t max_bricks);

/// Whether a brick was out of view for so long that it may be evicted.
bool unseen(const WorkingBrick& brick, std::uint32_t frame);

/// Keys of bricks whose memory is needed least, together at least `bytes`, or of all that may go: the largest product
/// of the frames since they were in view and their distance from the tag. Never those queued for publication, or with a
/// real surface's model.
std::vector<BrickKey> least_needed(const WorkingBricks& bricks, std::size_t bytes, std::uint32_t frame, float voxel_m);

}  // namespace lumigraft::reconstruct
