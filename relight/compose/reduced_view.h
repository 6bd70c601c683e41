#pragma once
// The colour camera at a fraction of its image size, for what is computed of the room at low resolution.
#include <memory>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "relight/compose/current_depth.h"
#include "relight/compose/pixel_rays.h"
#include "relight/passes/screen/camera_upload.h"

namespace lumigraft::relight {

class ReducedView {
 public:
  /// Each pixel represents a square of `scale` × `scale` pixels of the camera; squares at the right and lower border
  /// may be narrower.
  ReducedView(const capture::ColorCamera& camera, int scale);

  /// Pixel values are means over the square, and clip if any of its pixels does. Depth is that of the pixel nearest to
  /// the centre of the square that has any: a mean over a depth edge would be on neither surface.
  void take(const capture::FrameSet& frame);

  int scale() const { return scale_; }
  const capture::CameraModel& model() const { return camera_.model; }
  const CameraUpload& picture() const { return picture_; }
  const PixelRays& rays() const { return rays_; }
  /// Null: the frame has none.
  const capture::Image<float>* depth_m() const { return depth_m_.empty() ? nullptr : &depth_m_; }

 private:
  std::shared_ptr<const capture::Frame> reduced_color(const capture::Frame& color) const;
  template <typename T>
  capture::Image<T> sampled(const capture::Image<T>& image) const;

  int scale_;
  capture::CameraModel full_;
  capture::ColorCamera camera_;
  CameraUpload picture_;
  PixelRays rays_;
  capture::Image<float> depth_m_;
  std::shared_ptr<const capture::Image<float>> vignetting_, reduced_vignetting_;  ///< of the last frame; and of this
};

}  // namespace lumigraft::relight
