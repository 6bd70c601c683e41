#pragma once
// A rate limit that lets short bursts through (token bucket). Times are the caller's, in seconds.
#include <algorithm>

namespace lumigraft::server {

class TokenBucket {
 public:
  /// At most `per_s` a second in the long run, `at_once` after a pause.
  TokenBucket(double per_s, double at_once) : per_s_(per_s), at_once_(at_once), left_(at_once) {}
  /// False: too many.
  bool take(double now_s) {
    left_ = std::min(at_once_, left_ + per_s_ * std::max(0.0, now_s - last_s_));
    last_s_ = now_s;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
  }

 private:
  double per_s_, at_once_, left_, last_s_ = 0;
};

}  // namespace lumigraft::server
