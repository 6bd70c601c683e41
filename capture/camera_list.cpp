#include "capture/camera_list.h"

namespace lumigraft {

std::vector<CameraListing> list_cameras() {
  std::vector<CameraListing> all = list_openni_cameras();
  for (const auto list : {list_v4l2_cameras, list_libcamera_cameras, list_aravis_cameras}) {
    const std::vector<CameraListing> more = list();
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

}  // namespace lumigraft
