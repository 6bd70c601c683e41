#include <sstream>

#include "capture/live/camera_list.h"
#include "capture/live/helper_process.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture {

std::vector<CameraListing> list_freenect_cameras() {
  std::vector<CameraListing> out;
  std::istringstream lines(list_of_helper("lumigraft_freenect", kHelperParameters.patience));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("failed\t")) {
      out.push_back({.source = "freenect:", .name = "libfreenect", .rejection_reason = line.substr(7)});
    } else {
      out.push_back({.source = "freenect:" + line, .name = "Kinect for Xbox 360"});
      for (const char* pixels : {"rgb8", "z16"}) {
        out.back().formats.push_back({pixels, 640, 480, kFreenectParameters.rate_hz});
      }
    }
  }
  return out;
}

}  // namespace lumigraft::capture
