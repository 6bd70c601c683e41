#include "relight/views/light_reprojection.h"

#include <utility>

namespace lumigraft::relight {

const PixelRays& LightReprojection::rays_of(const RoomInView& view, const CameraRays& eye) {
  if (view.scale == 1) return eye.rays;
  if (view.scale != room_scale_) {
    room_scale_ = 0;  // until they are made: memory may run out
    room_rays_.emplace(view.camera);
    room_scale_ = view.scale;
  }
  return *room_rays_;
}

const ViewLight& LightReprojection::reproject(const ViewLight& light, const MovedObjects& objects,
                                              const CameraRays& eye, const CurrentDepth& depth,
                                              const CameraUpload& picture, PassClock& clock) {
  const Eigen::Isometry3f& T = eye.camera.T_tag_camera;
  now_.T_tag_camera = T;
  now_.room =
      reprojected(light.room, light.T_tag_camera, rays_of(light.room, eye), T, depth, &picture, std::move(now_.room));
  clock.done("reproject room");
  now_.objects = reprojected_objects(light, objects, now_.room, eye, depth);
  clock.done("reproject objects");
  return now_;
}

}  // namespace lumigraft::relight
