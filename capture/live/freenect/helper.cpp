// lumigraft_freenect: helper program that runs libfreenect with a Kinect for Xbox 360.
//
//   lumigraft_freenect list                     writes a serial number a line
//   lumigraft_freenect SERIAL STREAM...         writes what docs/helpers.md describes; an empty SERIAL is any camera
#include <libfreenect.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>

#include "capture/error.h"
#include "capture/live/helper_output.h"
#include "capture/live/parameters.h"
#include "capture/live/usb_permission.h"

namespace lumigraft::capture {
namespace {

constexpr int kWidth = 640, kHeight = 480;

/// Context of the library, closed at the end.
struct Library {
  Library() {
    if (freenect_init(&context, nullptr) != 0) throw CameraFault("libfreenect does not start: found no USB");
    freenect_set_log_level(context, FREENECT_LOG_FATAL);
    freenect_select_subdevices(context, FREENECT_DEVICE_CAMERA);
  }
  ~Library() { freenect_shutdown(context); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  std::vector<std::string> serials() const {
    std::vector<std::string> out;
    freenect_device_attributes* all = nullptr;
    freenect_list_device_attributes(context, &all);
    for (const freenect_device_attributes* one = all; one != nullptr; one = one->next) {
      out.emplace_back(one->camera_serial != nullptr ? one->camera_serial : "");
    }
    if (all != nullptr) freenect_free_device_attributes(all);
    return out;
  }

  freenect_context* context = nullptr;
};

/// Time and number of the frames of a stream.
class FrameClock {
 public:
  /// `ticks` of the camera's clock, which wraps every 71 s.
  Stamp stamp(std::uint32_t ticks) {
    if (last_ticks_) {
      const std::int64_t passed = static_cast<std::uint32_t>(ticks - *last_ticks_);
      ticks_ += passed;
      const double periods =
          static_cast<double>(passed) * kFreenectParameters.rate_hz / kFreenectParameters.tick_rate_hz;
      sequence_ += static_cast<std::uint64_t>(std::max(1L, std::lround(periods)));
    }
    last_ticks_ = ticks;
    return {static_cast<std::int64_t>(1e9 / kFreenectParameters.tick_rate_hz * static_cast<double>(ticks_)), 0,
            sequence_};
  }
  std::uint64_t sequence() const { return sequence_; }

 private:
  std::optional<std::uint32_t> last_ticks_;
  std::int64_t ticks_ = 0;
  std::uint64_t sequence_ = 0;
};

/// What the library's callbacks need; they run in freenect_process_events.
struct Output {
  std::vector<StreamSpec> specs;
  FrameClock color, depth;
};

void send_color(freenect_device* device, void* pixels, std::uint32_t ticks) {
  auto& out = *static_cast<Output*>(freenect_get_user(device));
  Frame frame{.stamp = out.color.stamp(ticks), .encoded = Image<std::uint8_t>(kWidth, kHeight, 3)};
  std::memcpy(frame.encoded.data.data(), pixels, frame.encoded.data.size());
  send_item(frame, out.specs);
}

void send_depth(freenect_device* device, void* counts, std::uint32_t ticks) {
  auto& out = *static_cast<Output*>(freenect_get_user(device));
  RawDepth depth{out.depth.stamp(ticks), Image<std::uint16_t>(kWidth, kHeight, 1)};
  std::memcpy(depth.counts.data.data(), counts, 2 * depth.counts.data.size());
  send_item(depth, out.specs);
}

void check(const StreamSpec& spec) {
  refuse_if(spec.width != kWidth || spec.height != kHeight,
            "found " + size_text(spec.width, spec.height) + ", allowed: " + size_text(kWidth, kHeight));
  refuse_if(spec.stream == Stream::depth && spec.unit_m != 0.001,
            "found unit_m = " + std::to_string(spec.unit_m) + ", allowed: 0.001");
}

void set_automatic(freenect_device* device, freenect_flag_value value) {
  freenect_set_flag(device, FREENECT_AUTO_EXPOSURE, value);
  freenect_set_flag(device, FREENECT_AUTO_WHITE_BALANCE, value);
}

void start(freenect_device* device, const Output& out) {
  set_automatic(device, FREENECT_ON);
  for (const StreamSpec& spec : out.specs) {
    int error = 0;
    if (spec.stream == Stream::depth) {
      const auto format = spec.registered ? FREENECT_DEPTH_REGISTERED : FREENECT_DEPTH_MM;
      freenect_set_depth_callback(device, send_depth);
      error = freenect_set_depth_mode(device, freenect_find_depth_mode(FREENECT_RESOLUTION_MEDIUM, format));
      error = error != 0 ? error : freenect_start_depth(device);
    } else {
      freenect_set_video_callback(device, send_color);
      error = freenect_set_video_mode(device, freenect_find_video_mode(FREENECT_RESOLUTION_MEDIUM, FREENECT_VIDEO_RGB));
      error = error != 0 ? error : freenect_start_video(device);
    }
    if (error != 0) throw CameraFault(std::string(name_of(spec.stream)) + " does not start");
  }
}

void run(const std::string& serial, const std::vector<StreamSpec>& specs) {
  for (const StreamSpec& spec : specs) check(spec);
  Output out{specs, {}, {}};
  Library library;
  std::vector<std::string> found = library.serials();
  std::erase_if(found, [&](const std::string& one) { return !serial.empty() && one != serial; });
  if (found.empty()) {
    const bool forbidden = serial.empty() && freenect_num_devices(library.context) > 0;  // counted without use
    throw CameraFault(forbidden ? kForbiddenUsb : "found no such camera");
  }
  freenect_device* device = nullptr;
  if (freenect_open_device_by_camera_serial(library.context, &device, found.front().c_str()) != 0) {
    throw CameraFault("found it in use by another program, or no permission to use it");
  }
  freenect_set_user(device, &out);
  start(device, out);
  send_text(HelperMessage::Kind::opened, found.front());
  bool adapting = true;
  while (freenect_process_events(library.context) >= 0) {
    // Radiance needs a fixed exposure. Not set by send_color: a callback of libusb may make no requests.
    if (adapting && out.color.sequence() >= kFreenectParameters.adapting_frames) {
      set_automatic(device, FREENECT_OFF);
      adapting = false;
    }
  }
  throw CameraFault("the camera is disconnected");
}

}  // namespace
}  // namespace lumigraft::capture

int main(int count, char** words) {
  using namespace lumigraft::capture;
  if (count != 2 || std::strcmp(words[1], "list") != 0) run_helper(count, words, run);
  try {
    for (const std::string& serial : Library().serials()) std::puts(serial.c_str());
  } catch (const CameraFault&) {  // without USB there is no camera
  }
}
