#include "capture/live/camera_list.h"

#include <algorithm>

namespace lumigraft::capture {

void find_same_hardware(std::vector<CameraListing>& cameras) {
  for (CameraListing& one : cameras) {
    for (const CameraListing& other : cameras) {
      const bool shared = std::ranges::find_first_of(one.nodes, other.nodes) != one.nodes.end();
      if (shared && &one != &other) one.same_hardware.push_back(other.source);
    }
  }
}

std::vector<CameraListing> list_cameras() {
  std::vector<CameraListing> all = list_openni_cameras();
  for (const auto list : {list_freenect_cameras, list_v4l2_cameras, list_libcamera_cameras, list_aravis_cameras}) {
    const std::vector<CameraListing> more = list();
    all.insert(all.end(), more.begin(), more.end());
  }
  find_same_hardware(all);
  return all;
}

}  // namespace lumigraft::capture
