#pragma once
// A camera node of the kernel's Video4Linux: its system calls, their errors and its words. Included by .cpp files
// alone.
#include <linux/videodev2.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/formats/pixel_format.h"

namespace lumigraft::capture::v4l2 {

/// Throws what `error` (an errno) means: a CameraFault where it may pass.
[[noreturn]] void fail(int error, const std::string& what);

class Device {
 public:
  /// Throws CameraFault where it cannot be opened, InputError where it is no camera. The reason alone is said.
  explicit Device(const std::string& path);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// 0 or the errno.
  int call(unsigned long request, void* argument) const;
  /// Throws as fail() does.
  void demand(unsigned long request, void* argument, const std::string& what) const;

  int descriptor() const { return descriptor_; }
  std::string card() const;
  std::string bus() const;
  bool multi_planar() const;
  v4l2_buf_type buffers() const;

 private:
  int descriptor_ = -1;
  v4l2_capability capability_{};
};

/// The node that a configuration calls `name`: a path, an entry of /dev/v4l/by-id or by-path, a card's name or its bus,
/// or the first camera for an empty name. Throws CameraFault where none is there.
std::string node_named(const std::string& name);
/// Nodes of cameras in the order of their numbers, those that cannot be opened among them.
std::vector<std::string> nodes();
/// What to call a node so that the same camera is found after it was plugged into another socket; the node where the
/// system keeps no such name.
std::string lasting_name(const std::string& node);

std::optional<PixelFormat> pixel_format_of(std::uint32_t fourcc);
std::string fourcc_text(std::uint32_t fourcc);
/// What the camera offers, in its own order.
std::vector<std::uint32_t> formats(const Device& device);

struct Size {
  int width = 0;
  int height = 0;
};
/// Every size, or the smallest and the largest where those between them are offered too; empty where it does not say.
struct Sizes {
  std::vector<Size> each;
  bool between = false;  ///< the two and what lies between
  bool holds(int width, int height) const;
};
Sizes sizes(const Device& device, std::uint32_t fourcc);
/// The highest; 0 where the camera does not say.
double highest_rate_hz(const Device& device, std::uint32_t fourcc, Size size);

}  // namespace lumigraft::capture::v4l2
