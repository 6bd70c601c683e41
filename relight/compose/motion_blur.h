#pragma once
// Blur of objects by their own motion while the camera exposes. That by the camera's motion is part of what soften.h
// takes from the picture.
#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "capture/session/session.h"
#include "relight/compose/object_layer.h"
#include "relight/compose/pixel_rays.h"
#include "relight/exhibit/exhibit.h"
#include "relight/tracing/meshes.h"

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
/// the nearest pixel counts. The window is that of the objects, grown within the image of `width` × `height` pixels.
ObjectLayer motion_blurred(const ObjectLayer& objects, const capture::Image<float>& shift_px, int width, int height);

/// Objects as a camera sees them while it exposes a frame.
class MotionBlur {
 public:
  /// Where the objects are, in the order of the motions.
  struct View {
    const PixelRays& rays;
    PosedCamera camera;
    std::vector<Eigen::Vector4f> spheres;   ///< around each: x, y, z, radius; tag frame
    std::function<const Meshes&()> meshes;  ///< called if spheres of objects that move differently overlap
  };

  MotionBlur() = default;  ///< all are at rest
  MotionBlur(std::vector<ObjectMotion> motions, View view) : motions_(std::move(motions)), view_(std::move(view)) {}

  bool any() const { return !motions_.empty(); }
  /// A layer whose distances are not known stays as it is.
  ObjectLayer of(const ObjectLayer& objects) const;

 private:
  capture::Image<float> shift_px(const ObjectLayer& objects) const;

  std::vector<ObjectMotion> motions_;
  std::optional<View> view_;
};

/// Of the objects that are drawn; empty if all are at rest, or the session does not state how long the camera exposes.
std::vector<ObjectMotion> motions_while_exposed(const capture::ColorCamera& camera, const Exhibit& exhibit,
                                                std::int64_t time_ns);

}  // namespace lumigraft::relight
