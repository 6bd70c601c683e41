#include "reconstruct/stage_cost.h"

#include <ctime>

namespace lumigraft::reconstruct {
namespace {

double process_cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

}  // namespace

CostClock::CostClock() : start_(std::chrono::steady_clock::now()), cpu_start_ms_(process_cpu_ms()) {}

StageCost CostClock::elapsed() const {
  return {std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count(),
          process_cpu_ms() - cpu_start_ms_};
}

}  // namespace lumigraft::reconstruct
