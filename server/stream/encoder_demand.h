#pragma once
// What viewers want at this moment: nothing is encoded that nobody watches.
#include <atomic>

namespace lumigraft::server {

struct EncoderDemand {
  std::atomic<int> h264 = 0;      ///< viewers
  std::atomic<int> jpeg = 0;      ///< viewers
  std::atomic<bool> key = false;  ///< somebody needs a key picture; whoever makes it clears this
};

}  // namespace lumigraft::server
