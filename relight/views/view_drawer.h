#pragma once
// From the light of a view to the picture: the change at every pixel of the camera, the objects as the camera sees them
// behind what is in front of them, and the camera's picture with both.
#include <optional>

#include "capture/session/session.h"
#include "relight/compose/motion_blur.h"
#include "relight/look/camera_look.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/views/pass_clock.h"
#include "relight/views/upsample_change.h"
#include "relight/views/view_light.h"

namespace lumigraft::relight {

class ViewDrawer {
 public:
  explicit ViewDrawer(const capture::Session& session) : session_(session), camera_(session.color) {}

  /// Begins the picture of a frame. `like_camera`: objects have the camera's noise and sharpness (plan.look).
  void take(const capture::FrameSet& frame, const std::optional<reconstruct::Pose>& pose, bool like_camera,
            PassClock& clock);
  const CameraUpload& camera() const { return camera_; }

  /// `light`: of the view of `eye`. `anew`: it is not that of the last call. `motion`: of the objects while the camera
  /// exposes.
  void draw(const ViewLight& light, bool anew, const CameraRays& eye, const CurrentDepth& depth,
            const MotionBlur& motion, PassClock& clock);
  /// The picture, of the light that was drawn last.
  void compose(const ViewLight& light, const capture::FrameSet& frame, bool anew, capture::Image<std::uint8_t>* picture,
               PassClock& clock);

  /// 3 channels, L_Δ of real pixels of the camera, W/sr/m²
  const capture::Image<float>& change(const ViewLight& light) const {
    return light.room.scale > 1 || divided_ ? full_.change : light.room.change;
  }
  const ObjectLayer& shown() const { return shown_; }  ///< behind what is in front of them

 private:
  capture::Session session_;
  CameraUpload camera_;
  CameraLook look_;
  bool like_camera_ = false;
  bool drawn_ = false;    ///< the light of the last call
  FullChange full_;       ///< of a view with fewer pixels than the camera; `change` also if it is
  bool divided_ = false;  ///< at outlines of what moved
  ObjectLayer shown_;
  float blur_px_ = 0;     ///< of `shown_`,
  bool blurred_ = false;  ///< and whether the objects' own motion blurs it
};

}  // namespace lumigraft::relight
