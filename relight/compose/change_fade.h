#pragma once
// Opacity of everything that is added to live pictures: objects and change of light fade out together while the
// camera's picture or pose is missing, and fade in when both are back. When depth stops (held_depth.h) they fade out
// with the last depth and fade in without: what is in front of objects is not known any more.
//
// Without a current pose (Pose::From::past) the last one is used for a moment, during which all fades out. When the
// lens is covered, the picture becomes dark or loses its contrast: nothing is rendered for it, and the last change
// darkens with it and fades out. A lamp that is switched off leaves contrast. Times are those of frames.
#include <cstdint>
#include <memory>
#include <optional>

#include "capture/frame.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::relight {

/// Measures of a picture by which a covered lens is recognized.
struct ViewMeasure {
  float light = 0;     ///< mean linear value, 0 to 1
  float contrast = 0;  ///< between blocks of the picture, pixel values
};
ViewMeasure measure_view(const capture::Image<std::uint8_t>& picture);

class ChangeFade {
 public:
  /// Once per frame, before it is rendered. `depth_stopped`: HeldDepth::stopped.
  void follow(const capture::FrameSet& frame, const capture::Image<std::uint8_t>& picture,
              const std::optional<reconstruct::Pose>& pose, bool depth_stopped = false);
  /// 0 to 1; 1 until something was missing.
  float opacity() const { return opacity_ * dimmed_; }
  bool covered() const { return covered_; }
  /// Of a frame that is not covered: blends the relit picture with that of the camera, by pixel values: equal
  /// steps look equal.
  void apply(const std::shared_ptr<const capture::Image<std::uint8_t>>& camera, capture::Image<std::uint8_t>* picture);
  /// Of a covered one: adds what the last picture changed to that of the camera.
  void add_last(capture::Image<std::uint8_t>* picture) const;
  /// Of a frame to which nothing was added: then nothing remains to be faded out.
  void forget_last() { last_relit_ = {}; }

 private:
  bool is_covered(const ViewMeasure& now, bool sees_tag) const;

  std::int64_t last_ns_ = 0;
  bool any_ = false, covered_ = false;
  ViewMeasure usual_;
  std::shared_ptr<const capture::Image<std::uint8_t>> last_camera_;
  capture::Image<std::uint8_t> last_relit_;  ///< at full opacity
  float opacity_ = 1;
  float dimmed_ = 1;  ///< the picture's light over the usual, while covered
};

}  // namespace lumigraft::relight
