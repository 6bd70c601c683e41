#include "capture/live/camera_list.h"

#include <algorithm>

namespace lumigraft::capture {

void find_same_hardware(std::vector<CameraListing>& cameras) {
  for (CameraListing& one : cameras) {
    for (const CameraListing& other : cameras) {
      const bool shared = std::any_of(one.nodes.begin(), one.nodes.end(), [&](const std::string& node) {
        return std::find(other.nodes.begin(), other.nodes.end(), node) != other.nodes.end();
      });
      if (shared && &one != &other) {
        one.same_hardware.push_back(other.source);
      }
    }
  }
}

std::vector<CameraListing> list_cameras() {
  std::vector<CameraListing> all = list_openni_cameras();
  for (const auto list : {list_v4l2_cameras, list_libcamera_cameras, list_aravis_cameras}) {
    const std::vector<CameraListing> more = list();
    all.insert(all.end(), more.begin(), more.end());
  }
  find_same_hardware(all);
  return all;
}

}  // namespace lumigraft::capture
