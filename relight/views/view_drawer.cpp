#include "relight/views/view_drawer.h"

#include <utility>

#include "relight/compose/add_noise.h"
#include "relight/compose/change_matte.h"
#include "relight/compose/composer.h"
#include "relight/compose/foreground_matte.h"
#include "relight/compose/soften.h"
#include "relight/compose/subsample_chroma.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {

void ViewDrawer::take(const capture::FrameSet& frame, const std::optional<reconstruct::Pose>& pose, bool like_camera,
                      PassClock& clock) {
  camera_.take(frame);
  like_camera_ = like_camera;
  if (!like_camera) return;
  const capture::CameraModel& model = session_.color.model;
  look_.follow(camera_.coded(), model, pose, depth_of(frame, model));
  clock.done("camera look");
}

void ViewDrawer::draw(const ViewLight& light, bool anew, const CameraRays& eye, const CurrentDepth& depth,
                      const MotionBlur& motion, PassClock& clock) {
  anew = anew || !drawn_;
  const float blur_px = like_camera_ ? look_.blur_px() : 0;
  if (!anew && blur_px_ == blur_px && blurred_ == motion.any()) return;
  drawn_ = false;  // until all below is done: memory may run out
  blur_px_ = blur_px;
  blurred_ = motion.any();
  if (anew) {
    divided_ = !light.front.empty();
    if (light.room.scale > 1) {
      upsample(light.room, eye, depth, light.objects, camera_, full_);
      clock.done("upsample");
    } else if (divided_) {
      full_.change = light.room.change;
    }
  }
  const int width = session_.color.model.width, height = session_.color.model.height;
  const auto show_objects = [&] {
    shown_ = motion.any() ? softened(motion.of(light.objects), blur_px, width, height)
                          : softened(light.objects, blur_px, width, height);
    hide_behind_foreground(depth, camera_, shown_);
  };
  // Neither needs the other.
  for_each_index(anew && divided_ ? 2 : 1, 1, [&](int k) {
    k == 0 ? show_objects() : divide_change(depth, camera_, light.front, light.objects, full_.change);
  });
  drawn_ = true;
  clock.done("soften and mattes");
}

void ViewDrawer::compose(const ViewLight& light, const capture::FrameSet& frame, bool anew,
                         capture::Image<std::uint8_t>* picture, PassClock& clock) {
  const capture::Image<float>& radiance = light.room.scale > 1 ? full_.radiance : light.room.radiance;
  relight::compose(camera_, {change(light), &radiance, like_camera_}, shown_, picture);
  if (like_camera_ && frame.color->original)
    subsample_chroma(capture::chroma_block(*frame.color->original), shown_, picture);
  if (anew) clock.done("compose");
  if (like_camera_ && look_.noise()) {
    add_noise(*look_.noise(), *camera_.coded(), shown_, frame.index, picture);
    clock.done("noise");
  }
}

}  // namespace lumigraft::relight
