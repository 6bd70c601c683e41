#pragma once
// Wall time of the passes of a picture.
#include <chrono>
#include <string_view>
#include <vector>

#include "relight/gpu/device.h"

namespace lumigraft::relight {

class PassClock {
 public:
  explicit PassClock(std::vector<gpu::PassTime>& passes) : passes_(passes) {}
  /// The pass took the time since the last one was done.
  void done(const char* pass) {
    const auto now = std::chrono::steady_clock::now();
    passes_.push_back({pass, std::chrono::duration<double, std::milli>(now - last_).count()});
    last_ = now;
  }
  double total_ms() const { return ms_since(began_); }
  double ms_of(std::string_view pass) const {
    double sum = 0;
    for (const gpu::PassTime& one : passes_) sum += one.name == pass ? one.gpu_ms : 0;
    return sum;
  }

 private:
  static double ms_since(std::chrono::steady_clock::time_point moment) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - moment).count();
  }

  std::vector<gpu::PassTime>& passes_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now(), last_ = began_;
};

}  // namespace lumigraft::relight
