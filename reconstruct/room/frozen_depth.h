#pragma once
// Depth cameras that repeat one picture.
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// Compares depth with that of the frames before. Noise makes every depth picture another one, and a rendered one
/// without noise is the same while nothing moves: where all its values are those of an earlier picture and what the
/// colour camera sees has moved since, depth is not of this moment.
class FrozenDepth {
 public:
  /// The frame, without depth if that is not of this moment. Needs depth on the pixels of the colour camera.
  capture::FrameSet check(const capture::FrameSet& frame);
  /// Of the last frame.
  std::vector<std::string> warnings() const;

 private:
  std::shared_ptr<const capture::DepthFrame> depth_;  ///< first of those that are equal
  capture::Image<float> seen_with_it_;                ///< by the colour camera, green at half the resolution
  bool frozen_ = false;
};

}  // namespace lumigraft::reconstruct
