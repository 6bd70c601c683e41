#pragma once
// Wall-clock and CPU time of a stage's work.
#include <chrono>

namespace lumigraft::reconstruct {

struct StageCost {
  double wall_ms = 0;
  double cpu_ms = 0;  ///< user + system of the whole process, because software GPUs work on their own threads
};

/// Starts at construction.
class CostClock {
 public:
  CostClock();
  StageCost elapsed() const;

 private:
  std::chrono::steady_clock::time_point start_;
  double cpu_start_ms_;
};

}  // namespace lumigraft::reconstruct
