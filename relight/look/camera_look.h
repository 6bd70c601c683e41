#pragma once
// How the camera renders what it sees, beyond its response: noise and sharpness. Measured while it runs, for `plan.look
// = camera`.
#include <memory>

#include "capture/image.h"
#include "reconstruct/scene.h"
#include "relight/look/noise_estimator.h"

namespace lumigraft::relight {

class CameraLook {
 public:
  /// Of each frame, sRGB pixel values. `pose`: with the width of the tags' edges; while it is unknown nothing is
  /// measured. `depth_m`: of the camera's size; null: not measured.
  void follow(const std::shared_ptr<const capture::Image<std::uint8_t>>& picture, const capture::CameraModel& camera,
              const std::optional<reconstruct::Pose>& pose, const capture::Image<float>* depth_m);

  /// Null while it is not known.
  const NoiseModel* noise() const { return noise_.model().get(); }
  /// 1σ of the blur of lens and motion without that of the pixels' area, as a Gaussian; 0 while it is not known.
  /// Changes in steps, so that a still view stays the same.
  float blur_px() const { return blur_px_; }

 private:
  NoiseEstimator noise_;
  double variance_px2_ = -1;  ///< of the blur, mean over time; negative: not known
  float blur_px_ = 0;
};

}  // namespace lumigraft::relight
