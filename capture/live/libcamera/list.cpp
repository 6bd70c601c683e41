#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

#include "capture/descriptor.h"
#include "capture/error.h"
#include "capture/live/camera_list.h"
#include "capture/live/helper_process.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture {
namespace {

/// Output of the helper.
std::string helper_output() {
  int ends[2];
  if (pipe(ends) != 0) return {};
  const Descriptor read_end(ends[0]);
  Descriptor write_end(ends[1]);
  std::string out;
  try {
    const HelperProcess helper("lumigraft_libcamera", {"list"}, write_end.number(), STDOUT_FILENO);
    write_end = Descriptor();  // so that reading ends with the helper
    constexpr int kTimeout_ms = static_cast<int>(kLibcameraParameters.list_timeout.count());
    char piece[4096];
    pollfd waiting{read_end.number(), POLLIN, 0};
    for (ssize_t size = 1; size > 0 && poll(&waiting, 1, kTimeout_ms) > 0;) {
      size = read(waiting.fd, piece, sizeof piece);
      out.append(piece, static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    }
  } catch (const CameraFault& e) {
    out = std::string("failed\t") + e.what() + "\n";
  }
  return out;
}

}  // namespace

std::vector<CameraListing> list_libcamera_cameras() {
  std::vector<CameraListing> out;
  std::istringstream lines(helper_output());
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
