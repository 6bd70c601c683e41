#pragma once
// What a piece of work costs, on the clock and on the processors.
#include <chrono>

namespace lumigraft::reconstruct {

struct StageCost {
  double wall_ms = 0;
  double cpu_ms = 0;  ///< user + system of the whole process: software GPUs work on threads of their own
};

/// Starts when it is made.
class CostClock {
 public:
  CostClock();
  StageCost elapsed() const;

 private:
  std::chrono::steady_clock::time_point start_;
  double cpu_start_ms_;
};

}  // namespace lumigraft::reconstruct
