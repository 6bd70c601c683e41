#include "capture/live/v4l2/device.h"

#include <fcntl.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "capture/error.h"

namespace lumigraft::capture::v4l2 {
namespace {

namespace fs = std::filesystem;

struct FormatPair {
  std::uint32_t fourcc;
  PixelFormat format;
};

constexpr std::array<FormatPair, 17> kFormats = {{{V4L2_PIX_FMT_YUYV, PixelFormat::yuyv},
                                                  {V4L2_PIX_FMT_UYVY, PixelFormat::uyvy},
                                                  {V4L2_PIX_FMT_NV12, PixelFormat::nv12},
                                                  {V4L2_PIX_FMT_NV12M, PixelFormat::nv12},
                                                  {V4L2_PIX_FMT_RGB24, PixelFormat::rgb8},
                                                  {V4L2_PIX_FMT_BGR24, PixelFormat::bgr8},
                                                  {V4L2_PIX_FMT_SRGGB8, PixelFormat::bayer_rggb8},
                                                  {V4L2_PIX_FMT_SBGGR8, PixelFormat::bayer_bggr8},
                                                  {V4L2_PIX_FMT_SGBRG8, PixelFormat::bayer_gbrg8},
                                                  {V4L2_PIX_FMT_SGRBG8, PixelFormat::bayer_grbg8},
                                                  {V4L2_PIX_FMT_MJPEG, PixelFormat::mjpeg},
                                                  {V4L2_PIX_FMT_JPEG, PixelFormat::mjpeg},
                                                  {V4L2_PIX_FMT_GREY, PixelFormat::grey8},
                                                  {V4L2_PIX_FMT_Y10, PixelFormat::grey10},
                                                  {V4L2_PIX_FMT_Y12, PixelFormat::grey12},
                                                  {V4L2_PIX_FMT_Y16, PixelFormat::grey16},
                                                  {V4L2_PIX_FMT_Z16, PixelFormat::z16}}};

constexpr const char* kNameFolders[] = {"/dev/v4l/by-id", "/dev/v4l/by-path"};

std::string text_of(const __u8* bytes, std::size_t size) {
  const char* begin = reinterpret_cast<const char*>(bytes);
  return {begin, strnlen(begin, size)};
}

std::vector<fs::path> entries(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> out;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

void fail(int error, const std::string& what) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      throw CameraFault("found no such camera");
    case EACCES:
    case EPERM:
      throw CameraFault("found no permission to use it, allowed: root and members of the group video");
    case EBUSY:
      throw CameraFault("found it in use by another program");
    default:
      throw CameraFault(what + ": " + std::strerror(error));
  }
}

Device::Device(const std::string& path) : descriptor_(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
  if (descriptor_.number() < 0) fail(errno, "open");
  const int error = call(VIDIOC_QUERYCAP, &capability_);
  const std::uint32_t offers =
      (capability_.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability_.device_caps : capability_.capabilities;
  capability_.device_caps = offers;
  const bool captures = (offers & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) != 0;
  if (error == 0 && captures && (offers & V4L2_CAP_STREAMING) != 0) return;
  if (error != 0 && error != ENOTTY && error != EINVAL) fail(error, "capabilities");
  throw InputError("found no camera that streams, allowed: a node of one, as `lumigraft devices` lists");
}

int Device::call(unsigned long request, void* argument) const {
  int result = 0;
  do {
    result = ioctl(descriptor_.number(), request, argument);
  } while (result < 0 && errno == EINTR);
  return result < 0 ? errno : 0;
}

void Device::demand(unsigned long request, void* argument, const std::string& what) const {
  if (const int error = call(request, argument); error != 0) fail(error, what);
}

std::string Device::card() const { return text_of(capability_.card, sizeof capability_.card); }
std::string Device::bus() const { return text_of(capability_.bus_info, sizeof capability_.bus_info); }
v4l2_buf_type Device::buffers() const {
  return multi_planar() ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

std::vector<std::string> nodes() {
  std::vector<std::pair<int, std::string>> numbered;
  for (const fs::path& path : entries("/dev")) {
    const std::string name = path.filename().string();
    if (name.rfind("video", 0) != 0 || name.size() == 5 ||
        name.find_first_not_of("0123456789", 5) != std::string::npos) {
      continue;
    }
    try {
      const Device device(path.string());
    } catch (const CameraFault&) {  // in use or without permission, but a camera
    } catch (const InputError&) {
      continue;
    }
    numbered.emplace_back(std::stoi(name.substr(5, 6)), path.string());
  }
  std::sort(numbered.begin(), numbered.end());
  std::vector<std::string> out;
  for (auto& [number, path] : numbered) out.push_back(std::move(path));
  return out;
}

std::string find_node(const std::string& name) {
  if (name.rfind('/', 0) == 0) return name;
  for (const char* folder : kNameFolders) {
    std::error_code error;
    if (!name.empty() && fs::exists(fs::path(folder) / name, error)) return (fs::path(folder) / name).string();
  }
  for (const std::string& node : nodes()) {
    if (name.empty()) return node;
    try {
      const Device device(node);
      if (device.card() == name || device.bus() == name) return node;
    } catch (const InputError&) {
    }
  }
  throw CameraFault("found no such camera");
}

std::string persistent_name(const std::string& node) {
  for (const char* folder : kNameFolders) {
    for (const fs::path& entry : entries(folder)) {
      std::error_code error;
      if (fs::canonical(entry, error) == fs::path(node) && !error) return entry.filename().string();
    }
  }
  return node;
}

std::optional<PixelFormat> pixel_format_of(std::uint32_t fourcc) {
  const auto* found = std::ranges::find(kFormats, fourcc, &FormatPair::fourcc);
  return found != kFormats.end() ? std::optional(found->format) : std::nullopt;
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string out;
  for (int i = 0; i < 4; ++i) {
    const char c = static_cast<char>(fourcc >> (8 * i) & 0x7f);
    out += c >= 0x20 && c < 0x7f ? c : '?';
  }
  return out;
}

std::vector<std::uint32_t> formats(const Device& device) {
  std::vector<std::uint32_t> out;
  v4l2_fmtdesc entry{};
  entry.type = device.buffers();
  while (device.call(VIDIOC_ENUM_FMT, &entry) == 0) {
    out.push_back(entry.pixelformat);
    ++entry.index;
  }
  return out;
}

bool Sizes::contains(int width, int height) const {
  if (range) {
    return width >= each[0].width && height >= each[0].height && width <= each[1].width && height <= each[1].height;
  }
  return each.empty() ||
         std::any_of(each.begin(), each.end(), [&](const Size& s) { return s.width == width && s.height == height; });
}

Sizes sizes(const Device& device, std::uint32_t fourcc) {
  Sizes out;
  v4l2_frmsizeenum entry{};
  entry.pixel_format = fourcc;
  for (; device.call(VIDIOC_ENUM_FRAMESIZES, &entry) == 0; ++entry.index) {
    if (entry.type != V4L2_FRMSIZE_TYPE_DISCRETE) {
      out.each = {{static_cast<int>(entry.stepwise.min_width), static_cast<int>(entry.stepwise.min_height)},
                  {static_cast<int>(entry.stepwise.max_width), static_cast<int>(entry.stepwise.max_height)}};
      out.range = true;
      return out;
    }
    out.each.push_back({static_cast<int>(entry.discrete.width), static_cast<int>(entry.discrete.height)});
  }
  return out;
}

double highest_rate_hz(const Device& device, std::uint32_t fourcc, Size size) {
  double best_hz = 0.0;
  v4l2_frmivalenum entry{};
  entry.pixel_format = fourcc;
  entry.width = static_cast<__u32>(size.width);
  entry.height = static_cast<__u32>(size.height);
  for (; device.call(VIDIOC_ENUM_FRAMEINTERVALS, &entry) == 0; ++entry.index) {
    const v4l2_fract& period = entry.type == V4L2_FRMIVAL_TYPE_DISCRETE ? entry.discrete : entry.stepwise.min;
    if (period.numerator > 0) best_hz = std::max(best_hz, static_cast<double>(period.denominator) / period.numerator);
    if (entry.type != V4L2_FRMIVAL_TYPE_DISCRETE) break;
  }
  return best_hz;
}

}  // namespace lumigraft::capture::v4l2
