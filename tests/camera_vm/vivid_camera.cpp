#include "tests/camera_vm/vivid_camera.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace lumigraft::test {

StreamSpec vivid_spec(PixelFormat format) {
  StreamSpec spec{.stream = Stream::fisheye, .width = kVividWidth, .height = kVividHeight, .exposure = 2.5};
  spec.settings.pixel_format = format;
  spec.settings.controls = {{"osd_text_mode", 2}};
  return spec;
}

Vivid::Vivid(const std::string& bus) {
  for (int i = 0; i < 8 && descriptor_ < 0; ++i) {
    descriptor_ = ::open(("/dev/video" + std::to_string(i)).c_str(), O_RDWR | O_CLOEXEC);
    v4l2_capability capability{};
    if (descriptor_ >= 0 && (ioctl(descriptor_, VIDIOC_QUERYCAP, &capability) != 0 ||
                             bus != reinterpret_cast<const char*>(capability.bus_info))) {
      close(descriptor_);
      descriptor_ = -1;
    }
  }
}

Vivid::~Vivid() {
  if (descriptor_ >= 0) {
    close(descriptor_);
  }
}

bool Vivid::set(const std::string& control, std::int64_t value) const {
  v4l2_query_ext_ctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (ioctl(descriptor_, VIDIOC_QUERY_EXT_CTRL, &query) == 0) {
    if (control == query.name) {
      v4l2_control one{query.id, static_cast<__s32>(value)};
      return ioctl(descriptor_, VIDIOC_S_CTRL, &one) == 0;
    }
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return false;
}

}  // namespace lumigraft::test
