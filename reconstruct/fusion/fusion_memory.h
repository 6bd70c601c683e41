#pragma once
// Memory that fusion uses.
#include <cstddef>

namespace lumigraft::reconstruct {

struct FusionMemory {
  std::size_t bricks = 0;      ///< of the published field
  std::size_t used_bytes = 0;  ///< of bricks, also those that only earlier fields contain
  std::size_t evicted = 0;     ///< bricks so far
};

}  // namespace lumigraft::reconstruct
