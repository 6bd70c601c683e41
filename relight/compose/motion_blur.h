#pragma once
// Blur of objects by their own motion while the camera exposes. That by the camera's motion is part of what soften.h
// takes from the picture.
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "relight/compose/object_layer.h"
#include "relight/exhibit/exhibit.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// Of one object: from where its points are at the time of the frame to where they are when the exposure begins and
/// ends, tag frame.
struct ObjectMotion {
  Eigen::Affine3f to_begin = Eigen::Affine3f::Identity(), to_end = Eigen::Affine3f::Identity();
  bool any = false;

  /// By which a point moves in the image over the exposure, pixels; empty if the camera does not see it then.
  std::optional<Eigen::Vector2f> shift_px(const PosedCamera& camera, const Eigen::Vector3f& at_m) const;
};

/// Of the objects that are drawn, in the exhibit's order, by VirtualObject::motion. The time of the frame is the middle
/// of the exposure.
std::vector<ObjectMotion> motions_over(const Exhibit& exhibit, double time_s, double exposure_s);

/// Each pixel becomes the mean along the way of what is there, weighted by coverage. `shift_px`: two channels, of the
/// layer's window: ObjectMotion::shift_px of the surface at a pixel, 0 where there is none; beside the object that of
/// the nearest pixel counts. The window grows within the image of `width` × `height` pixels.
ObjectLayer motion_blurred(const ObjectLayer& objects, const capture::Image<float>& shift_px, int width, int height);

}  // namespace lumigraft::relight
