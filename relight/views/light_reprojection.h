#pragma once
// The light of a view as the camera sees it from another pose, with the objects at other places.
#include <optional>

#include "relight/views/pass_clock.h"
#include "relight/views/reprojected_objects.h"
#include "relight/views/reprojected_room.h"

namespace lumigraft::relight {

class LightReprojection {
 public:
  /// Of the result room, objects and pose are valid, until the next call. `eye`, `depth`, `picture`: of now, of the
  /// camera's own pixels.
  const ViewLight& reproject(const ViewLight& light, const MovedObjects& objects, const CameraRays& eye,
                             const CurrentDepth& depth, const CameraUpload& picture, PassClock& clock);

 private:
  const PixelRays& rays_of(const RoomInView& view, const CameraRays& eye);

  /// Of the room's pixels at a scale, and that scale.
  std::optional<PixelRays> room_rays_;
  int room_scale_ = 0;
  ViewLight now_;
};

}  // namespace lumigraft::relight
