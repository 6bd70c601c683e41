// usb_camera WIDTH HEIGHT RATE [depth|adapting]: a webcam on the kernel's emulated USB port (dummy_hcd, gadgetfs):
// MJPEG over a bulk endpoint as in USB Video Class 1.0, with exposure, gain and white balance. It shows four bars, red,
// green, blue and grey, with the value 50 at 10 ms, proportional to the exposure, which takes effect two frames after
// it was set. With `depth` it is a depth camera, with pictures of depth_counts() in the format Z16 of UVC. With
// `adapting` its automatic exposure approaches 24 ms, which it reports; switched off, it is 10 ms again at once, and
// the next request waits for two frames. SIGUSR1 truncates the next frame; SIGUSR2 stops the frames until the next
// SIGUSR2.
#include <turbojpeg.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <thread>

#include "tests/integration/camera_vm/usb_depth.h"
#include "tests/integration/camera_vm/usb_port.h"

namespace {

using namespace lumigraft;
using test::add;
using test::Bytes;
using test::put;

constexpr std::uint8_t kStreamEndpoint = 0x81;
constexpr std::uint32_t kLargestPayload = 1 << 18;

std::atomic<bool> streaming{false};
std::atomic<int> endpoint{-1};
std::atomic<std::uint32_t> exposure{100};  ///< in units of 100 µs
volatile std::sig_atomic_t cut_next = 0, frozen = 0;

struct Mode {
  int width = 0, height = 0, rate_hz = 0;
  bool depth = false, adapting = false;
  std::uint32_t interval() const { return 10'000'000u / static_cast<std::uint32_t>(rate_hz); }  ///< 100 ns
  std::uint32_t largest_picture() const { return static_cast<std::uint32_t>(2 * width * height); }
};

/// USB Device Class Definition for Video Devices 1.0, chapter 3: terminals, units, one format and one size.
Bytes configuration(const Mode& mode, std::uint32_t packet) {
  Bytes control;
  add(control, {0x24, 2, 1, 0x01, 0x02, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0x0A, 0, 0});  // camera: exposure and its mode
  add(control, {0x24, 5, 2, 1, 0, 0, 2, 0x40, 0x16, 0});  // white balance and its mode, gain, mains
  add(control, {0x24, 3, 3, 0x01, 0x01, 0, 2, 0});        // output to USB
  Bytes head{0x24, 1, 0x00, 0x01};
  put(head, static_cast<std::uint32_t>(13 + control.size()), 2);
  put(head, 48'000'000, 4);
  head.insert(head.end(), {1, 1});

  Bytes stream;
  if (mode.depth) {
    add(stream, {0x24, 4,    1,    1,    'Z',  '1',  '6',  ' ', 0, 0, 0x10, 0, 0x80,
                 0,    0x00, 0xAA, 0x00, 0x38, 0x9B, 0x71, 16,  1, 0, 0,    0, 0});  // uncompressed, GUID of Z16
  } else {
    add(stream, {0x24, 6, 1, 1, 1, 1, 0, 0, 0, 0});  // MJPEG
  }
  Bytes size{0x24, static_cast<std::uint8_t>(mode.depth ? 5 : 7), 1, 0};
  put(size, static_cast<std::uint32_t>(mode.width), 2);
  put(size, static_cast<std::uint32_t>(mode.height), 2);
  put(size, 1'000'000, 4);
  put(size, 100'000'000, 4);
  put(size, mode.largest_picture(), 4);
  put(size, mode.interval(), 4);
  size.push_back(1);
  put(size, mode.interval(), 4);
  add(stream, size);
  add(stream, {0x24, 13, 1, 1, 4});  // BT.601
  Bytes stream_head{0x24, 1, 1};
  put(stream_head, static_cast<std::uint32_t>(14 + stream.size()), 2);
  stream_head.insert(stream_head.end(), {kStreamEndpoint, 0, 3, 0, 0, 0, 1, 0});

  Bytes out;
  add(out, {USB_DT_INTERFACE_ASSOCIATION, 0, 2, USB_CLASS_VIDEO, 3, 0, 0});
  add(out, {USB_DT_INTERFACE, 0, 0, 0, USB_CLASS_VIDEO, 1, 0, 0});
  add(out, head);
  out.insert(out.end(), control.begin(), control.end());
  add(out, {USB_DT_INTERFACE, 1, 0, 1, USB_CLASS_VIDEO, 2, 0, 0});
  add(out, stream_head);
  out.insert(out.end(), stream.begin(), stream.end());
  Bytes end{USB_DT_ENDPOINT, kStreamEndpoint, USB_ENDPOINT_XFER_BULK};
  put(end, packet, 2);
  end.push_back(0);
  add(out, end);

  Bytes result;
  Bytes first{USB_DT_CONFIG};
  put(first, static_cast<std::uint32_t>(9 + out.size()), 2);
  first.insert(first.end(), {2, 1, 0, 0xC0, 50});
  add(result, first);
  result.insert(result.end(), out.begin(), out.end());
  return result;
}

Bytes device_descriptor() {
  Bytes out;
  add(out, {USB_DT_DEVICE, 0x00, 0x02, 0xEF, 2, 1, 64, 0x6B, 0x1D, 0x02, 0x01, 0x00, 0x01, 1, 2, 3, 1});
  return out;
}

/// A control and its range; chapter 4.2.
struct Control {
  std::uint8_t unit, selector;
  int bytes;
  std::uint32_t low, high, step, usual, value;
};
std::array<Control, 6> controls = {{{1, 0x02, 1, 1, 8, 0x09, 8, 8},            // exposure mode: 1 manual, 8 auto
                                    {1, 0x04, 4, 1, 5000, 1, 100, 100},        // exposure
                                    {2, 0x04, 2, 0, 255, 1, 16, 16},           // gain
                                    {2, 0x0A, 2, 2800, 6500, 10, 4600, 4600},  // white balance
                                    {2, 0x0B, 1, 0, 1, 1, 1, 1},               // and its mode
                                    {2, 0x05, 1, 0, 2, 1, 2, 2}}};             // mains: 0 off, 1 50 Hz, 2 60 Hz

class Plug {
 public:
  explicit Plug(const Mode& mode)
      : mode_(mode), port_(configuration(mode, 64), configuration(mode, 512), device_descriptor()) {}
  bool plugged() const { return port_.plugged(); }
  void serve() {
    port_.serve([this](const usb_ctrlrequest& q) { answer(q); }, [] { streaming = false; });
  }

 private:
  void answer(const usb_ctrlrequest& q) {
    const int interface = q.wIndex & 0xFF, unit = q.wIndex >> 8, selector = q.wValue >> 8;
    if ((q.bRequestType & USB_TYPE_MASK) == USB_TYPE_STANDARD) {
      answer_standard(q);
    } else if (interface == 1 && (selector == 1 || selector == 2)) {
      agree(q, selector == 2);
    } else {
      for (Control& control : controls) {
        if (interface == 0 && control.unit == unit && control.selector == selector) {
          answer_control(q, control);
          return;
        }
      }
      port_.refuse(q);
    }
  }

  void answer_standard(const usb_ctrlrequest& q) {
    if (q.bRequest == USB_REQ_SET_CONFIGURATION) {
      configure();
      port_.acknowledge();
    } else if (q.bRequest == USB_REQ_SET_INTERFACE) {
      port_.acknowledge();
    } else if (q.bRequest == USB_REQ_GET_INTERFACE) {
      port_.reply(q, {0});
    } else if (q.bRequest == USB_REQ_GET_DESCRIPTOR && q.wValue >> 8 == USB_DT_STRING) {
      port_.reply_text(q, {"", "Maker", "Test Camera", "0123"});
    } else {
      port_.refuse(q);
    }
  }

  void configure() {
    if (endpoint >= 0) {
      return;
    }
    const int file = ::open("/dev/gadget/ep1in-bulk", O_RDWR);
    Bytes set_up;
    put(set_up, 1, 4);
    for (const std::uint32_t packet : {64u, 512u}) {
      Bytes body{USB_DT_ENDPOINT, kStreamEndpoint, USB_ENDPOINT_XFER_BULK};
      put(body, packet, 2);
      body.push_back(0);
      add(set_up, body);
    }
    if (file >= 0 && ::write(file, set_up.data(), set_up.size()) == static_cast<ssize_t>(set_up.size())) {
      endpoint = file;
    }
  }

  /// Probe and commit, 4.3.1.1: there is one format, one size and one rate.
  void agree(const usb_ctrlrequest& q, bool commit) {
    constexpr std::uint8_t kGetLength = 0x85, kGetInfo = 0x86;
    if ((q.bRequestType & USB_DIR_IN) == 0) {
      port_.receive(q);
      streaming = streaming || commit;
    } else if (q.bRequest == kGetLength) {
      port_.reply(q, {26, 0});
    } else if (q.bRequest == kGetInfo) {
      port_.reply(q, {3});
    } else {
      Bytes out{1, 0, 1, 1};
      put(out, mode_.interval(), 4);
      out.resize(18);
      put(out, mode_.largest_picture(), 4);
      put(out, kLargestPayload, 4);
      port_.reply(q, out);
    }
  }

  void answer_control(const usb_ctrlrequest& q, Control& control) {
    if ((q.bRequestType & USB_DIR_IN) == 0) {
      const Bytes data = port_.receive(q);
      control.value = 0;
      for (std::size_t i = 0; i < data.size(); ++i) {
        control.value |= std::uint32_t{data[i]} << (8 * i);
      }
      const bool returns_to_usual = mode_.adapting && &control == &controls[0] && control.value == 1;
      if (returns_to_usual) controls[1].value = controls[1].usual;
      exposure = controls[1].value;
      if (returns_to_usual) std::this_thread::sleep_for(std::chrono::milliseconds(100));  // for two frames
      return;
    }
    Bytes out;
    switch (q.bRequest) {
      case 0x81:
        put(out, control.value, control.bytes);
        break;
      case 0x82:
        put(out, control.low, control.bytes);
        break;
      case 0x83:
        put(out, control.high, control.bytes);
        break;
      case 0x84:
        put(out, control.step, control.bytes);
        break;
      case 0x85:
        put(out, static_cast<std::uint32_t>(control.bytes), 2);
        break;
      case 0x86:
        out.push_back(mode_.adapting ? 0x0B : 0x03);  // readable, settable, changed by the camera itself
        break;
      case 0x87:
        put(out, control.usual, control.bytes);
        break;
      default:
        port_.refuse(q);
        return;
    }
    port_.reply(q, out);
  }

  Mode mode_;
  test::UsbPort port_;
};

Bytes jpeg_of(const Mode& mode, std::uint32_t exposed) {
  const auto level = static_cast<std::uint8_t>(std::min(255u, 50 * exposed / 100));
  Bytes rgb(static_cast<std::size_t>(3 * mode.width * mode.height));
  for (int i = 0; i < mode.width * mode.height; ++i) {
    const int bar = i % mode.width * 4 / mode.width;
    for (int c = 0; c < 3; ++c) {
      rgb[static_cast<std::size_t>(3 * i + c)] = bar == 3 || bar == c ? level : 0;
    }
  }
  unsigned char* data = nullptr;
  unsigned long size = 0;
  const tjhandle encoder = tjInitCompress();
  tjCompress2(encoder, rgb.data(), mode.width, 0, mode.height, TJPF_RGB, &data, &size, TJSAMP_422, 90, 0);
  Bytes out(data, data + size);
  tjFree(data);
  tjDestroy(encoder);
  return out;
}

Bytes depth_of(const Mode& mode, int number) {
  Bytes out;
  for (const std::uint16_t count : test::depth_counts(mode.width, mode.height, number)) put(out, count, 2);
  return out;
}

constexpr std::uint32_t kAdapted = 240;  // in units of 100 µs

/// A step of the automatic exposure.
void adapt() {
  if (controls[0].value == 1) return;
  const std::uint32_t now = controls[1].value;
  controls[1].value = now + (kAdapted - now + 4) / 5;
  exposure = controls[1].value;
}

void stream(const Mode& mode) {
  using Clock = std::chrono::steady_clock;
  const auto period = std::chrono::nanoseconds(100 * std::int64_t{mode.interval()});
  Clock::time_point next = Clock::now();
  std::deque<std::uint32_t> in_the_sensor{100, 100};
  for (std::uint8_t number = 0;; ++number) {
    next = std::max(next + period, Clock::now());
    std::this_thread::sleep_until(next);
    if (!streaming || endpoint < 0 || frozen != 0) {
      continue;
    }
    if (mode.adapting) adapt();
    in_the_sensor.push_back(exposure);
    const Bytes picture = mode.depth ? depth_of(mode, number) : jpeg_of(mode, in_the_sensor.front());
    in_the_sensor.pop_front();
    // One payload per frame, 2.4.3.2: length of the header, then bits for frame parity, end of frame, end of header.
    Bytes payload{2, static_cast<std::uint8_t>(0x82 | (number & 1))};
    payload.insert(payload.end(), picture.begin(), picture.end());
    if (cut_next != 0) {
      cut_next = 0;
      payload.resize(payload.size() / 2);
    }
    if (payload.size() % 512 == 0) {
      payload.push_back(0);  // a short packet ends it
    }
    if (::write(endpoint, payload.data(), payload.size()) < 0) {
      std::this_thread::sleep_for(period);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    return 2;
  }
  std::signal(SIGUSR1, [](int) { cut_next = 1; });
  std::signal(SIGUSR2, [](int) { frozen = !frozen; });
  const Mode mode{std::atoi(argv[1]), std::atoi(argv[2]), std::atoi(argv[3]),
                  argc == 5 && argv[4] == std::string("depth"), argc == 5 && argv[4] == std::string("adapting")};
  Plug plug(mode);
  if (!plug.plugged()) {
    std::perror("/dev/gadget");
    return 1;
  }
  test::raise_priority(1);
  std::thread(stream, mode).detach();
  test::raise_priority(2);
  std::puts("plugged");
  std::fflush(stdout);
  plug.serve();
  std::_Exit(0);
}
