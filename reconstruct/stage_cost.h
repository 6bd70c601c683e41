#pragma once
// Wall-clock and CPU time of a stage's work.
#include <chrono>
#include <ctime>

namespace lumigraft::reconstruct {

struct StageCost {
  double wall_ms = 0;
  double cpu_ms = 0;  ///< user + system of the whole process, because software GPUs work on their own threads
};

/// Starts at construction.
class CostClock {
 public:
  StageCost elapsed() const {
    return {std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count(),
            process_cpu_ms() - cpu_start_ms_};
  }

 private:
  static double process_cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  }

  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double cpu_start_ms_ = process_cpu_ms();
};

}  // namespace lumigraft::reconstruct
