#pragma once
// The usual one of durations that vary and of which some are far too long, as when a machine stalls.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>

namespace lumigraft::server {

/// The median of the last three: a single outlier changes nothing, and a change is followed after two. One thread.
class UsualDuration {
 public:
  using Duration = std::chrono::steady_clock::duration;

  void add(Duration one) {
    last_[count_++ % last_.size()] = one;
    std::array<Duration, 3> sorted = last_;
    const std::size_t known = std::min(count_, sorted.size());
    std::sort(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(known));
    usual_ = sorted[(known - 1) / 2];
  }
  /// Zero before the first.
  Duration usual() const { return usual_; }

 private:
  std::array<Duration, 3> last_{};
  Duration usual_{};
  std::size_t count_ = 0;
};

}  // namespace lumigraft::server
