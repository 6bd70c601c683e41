#pragma once
// A device node of the kernel's Video4Linux: system calls, errors, formats and names. Included by .cpp files alone.
#include <linux/videodev2.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/descriptor.h"
#include "capture/formats/pixel_format.h"

namespace lumigraft::capture::v4l2 {

/// Throws a CameraFault with the meaning of `error` (an errno).
[[noreturn]] void fail(int error, const std::string& what);

class Device {
 public:
  /// Throws CameraFault if it cannot be opened, InputError if it is no camera, with the reason alone.
  explicit Device(const std::string& path);

  /// ioctl; returns 0 or the errno.
  int call(unsigned long request, void* argument) const;
  /// ioctl; throws as fail().
  void demand(unsigned long request, void* argument, const std::string& what) const;

  int descriptor() const { return descriptor_.number(); }
  std::string card() const;
  std::string bus() const;
  bool multi_planar() const { return (capability_.device_caps & V4L2_CAP_VIDEO_CAPTURE) == 0; }
  v4l2_buf_type buffers() const;

 private:
  Descriptor descriptor_;
  v4l2_capability capability_{};
};

/// The node of a camera that a configuration names by path, by an entry of /dev/v4l/by-id or by-path, by card name or
/// bus; the first camera for an empty name. Throws CameraFault if there is none.
std::string find_node(const std::string& name);
/// Nodes of cameras in numerical order, including those that cannot be opened.
std::vector<std::string> nodes();
/// Name under /dev/v4l that stays the same if the camera is plugged in elsewhere; the node itself if there is none.
std::string persistent_name(const std::string& node);

std::optional<PixelFormat> pixel_format_of(std::uint32_t fourcc);
std::string fourcc_text(std::uint32_t fourcc);
/// Formats that the camera offers, in its order.
std::vector<std::uint32_t> formats(const Device& device);

struct Size {
  int width = 0, height = 0;
};
/// Frame sizes: every size, or the smallest and the largest of a range; empty if the driver reports none.
struct Sizes {
  std::vector<Size> each;
  bool range = false;                          ///< `each` holds the two ends of a range
  bool contains(int width, int height) const;  ///< also true if no sizes are reported
};
Sizes sizes(const Device& device, std::uint32_t fourcc);
/// The highest rate; 0 if the driver reports none.
double highest_rate_hz(const Device& device, std::uint32_t fourcc, Size size);

}  // namespace lumigraft::capture::v4l2
