#include "tests/integration/camera_vm/vivid_camera.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <optional>

namespace lumigraft::test {

capture::StreamSpec vivid_spec(capture::PixelFormat format) {
  capture::StreamSpec spec{
      .stream = capture::Stream::fisheye, .width = kVividWidth, .height = kVividHeight, .exposure = 2.5};
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

namespace {

std::optional<v4l2_query_ext_ctrl> find(int descriptor, const std::string& control) {
  v4l2_query_ext_ctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (ioctl(descriptor, VIDIOC_QUERY_EXT_CTRL, &query) == 0) {
    if (control == query.name) {
      return query;
    }
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return std::nullopt;
}

}  // namespace

bool Vivid::set(const std::string& control, std::int64_t value) const {
  const auto found = find(descriptor_, control);
  v4l2_control one{found ? found->id : 0, static_cast<__s32>(value)};
  return found && ioctl(descriptor_, VIDIOC_S_CTRL, &one) == 0;
}

bool Vivid::choose(const std::string& control, const std::string& entry) const {
  const auto found = find(descriptor_, control);
  for (std::int64_t i = found ? found->minimum : 1; found && i <= found->maximum; ++i) {
    v4l2_querymenu menu{};
    menu.id = found->id;
    menu.index = static_cast<__u32>(i);
    if (ioctl(descriptor_, VIDIOC_QUERYMENU, &menu) == 0 && entry == reinterpret_cast<const char*>(menu.name)) {
      return set(control, i);
    }
  }
  return false;
}

bool Vivid::choose_input(const std::string& input) const {
  v4l2_input entry{};
  for (; ioctl(descriptor_, VIDIOC_ENUMINPUT, &entry) == 0; ++entry.index) {
    if (input == reinterpret_cast<const char*>(entry.name)) {
      int index = static_cast<int>(entry.index);
      return ioctl(descriptor_, VIDIOC_S_INPUT, &index) == 0;
    }
  }
  return false;
}

}  // namespace lumigraft::test
