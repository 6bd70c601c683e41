#include <sstream>

#include "capture/live/camera_list.h"
#include "capture/live/helper_process.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture {

std::vector<CameraListing> list_libcamera_cameras() {
  std::vector<CameraListing> out;
  std::istringstream lines(list_of_helper("lumigraft_libcamera", kLibcameraParameters.list_timeout));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    const auto field = [&fields] {
      std::string text;
      std::getline(fields, text, '\t');
      return text;
    };
    const std::string kind = field();
    if (kind == "camera") {
      const std::string id = field();
      out.push_back({.source = "libcamera:" + id, .name = field()});
    } else if (kind == "node" && !out.empty()) {
      out.back().nodes.push_back(field());
    } else if (kind == "failed") {
      out.push_back({.source = "libcamera:", .name = "libcamera", .rejection_reason = field()});
    } else if (kind == "format" && !out.empty()) {
      OfferedFormat format{.pixels = field()};
      fields >> format.width >> format.height;
      out.back().formats.push_back(std::move(format));
    } else if (kind == "control" && !out.empty()) {
      OfferedControl control{.name = field()};
      fields >> control.low >> control.high >> control.value;
      out.back().controls.push_back(std::move(control));
    }
  }
  return out;
}

}  // namespace lumigraft::capture
