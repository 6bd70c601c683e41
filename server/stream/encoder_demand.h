#pragma once
// Which encodings viewers currently request: a kind that no viewer requests is not encoded.
#include <atomic>

namespace lumigraft::server {

struct EncoderDemand {
  std::atomic<int> h264 = 0;      ///< viewers
  std::atomic<int> jpeg = 0;      ///< viewers
  std::atomic<bool> key = false;  ///< a viewer needs a key frame; the encoder clears this
};

}  // namespace lumigraft::server
