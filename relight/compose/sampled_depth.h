#pragma once
// Depth at every step-th pixel, as an image of a camera of its own.
#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "relight/compose/pixel_rays.h"

namespace lumigraft::relight {

class SampledDepth {
 public:
  /// `step`: pixels along each axis per sample, which is the one in the middle.
  SampledDepth(const capture::CameraModel& camera, int step);

  int step() const { return step_; }
  const capture::CameraModel& model() const { return model_; }  ///< whose pixels are the samples
  const PixelRays& rays() const { return rays_; }
  /// Metres along z; `depth_m`: of the camera's size. Valid until the next call.
  const capture::Image<float>& sample(const capture::Image<float>& depth_m);

 private:
  int step_;
  capture::CameraModel model_;
  PixelRays rays_;
  capture::Image<float> sampled_m_;
};

}  // namespace lumigraft::relight
