// lumigraft_libcamera: helper program that runs libcamera, started by LibcameraSource and list_libcamera_cameras.
//
//   lumigraft_libcamera list
//   lumigraft_libcamera open CAMERA WIDTH HEIGHT [KEY=VALUE ...]
//
// `list` writes lines of fields separated by tabs. `open` exchanges messages over descriptor 3 (messages.h) until the
// other end is closed. KEY is a key of session.toml: pixel_format, rate_hz, exposure_us, gain, controls.NAME.
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "capture/error.h"
#include "capture/live/libcamera/camera.h"

namespace lumigraft::capture::libcam {
namespace {

/// Sizes that the camera offers. For a range its two ends, where libcamera itself would list common sizes.
std::vector<libcamera::Size> sizes(const libcamera::StreamFormats& formats, const libcamera::PixelFormat& format) {
  const libcamera::SizeRange range = formats.range(format);
  const bool any = range.hStep > 0 && range.vStep > 0 && range.min != range.max;
  return any ? std::vector{range.min, range.max} : formats.sizes(format);
}

/// Device nodes of the camera.
std::vector<std::filesystem::path> nodes_of(const libcamera::Camera& camera) {
  std::vector<std::filesystem::path> out;
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    struct stat node {};
    if (entry.path().filename().string().starts_with("video") && stat(entry.path().c_str(), &node) == 0 &&
        S_ISCHR(node.st_mode) && camera_of_node(node.st_rdev).get() == &camera) {
      out.push_back(entry.path());
    }
  }
  return out;
}

/// Serial number of the USB camera of a node; empty for others.
std::string usb_serial(const std::filesystem::path& node) {
  // `device` is a USB interface; its parent is the camera.
  std::ifstream file("/sys/class/video4linux" / node.filename() / "device/../serial");
  std::string serial;
  std::getline(file, serial);
  return serial;
}

void list(libcamera::Camera& camera) {
  std::cout << "camera\t" << camera.id() << '\t' << model_of(camera) << '\n';
  for (const std::filesystem::path& node : nodes_of(camera)) std::cout << "node\t" << node.string() << '\n';
  std::vector<libcamera::PixelFormat> seen;
  for (const libcamera::StreamRole role : kRoles) {
    const auto configuration = camera.generateConfiguration({role});
    if (!configuration || configuration->empty()) continue;
    const libcamera::StreamFormats& formats = configuration->at(0).formats();
    for (const libcamera::PixelFormat& format : formats.pixelformats()) {
      if (std::find(seen.begin(), seen.end(), format) != seen.end()) continue;
      seen.push_back(format);
      const std::optional<PixelFormat> ours = pixel_format_of(format);
      for (const libcamera::Size& size : sizes(formats, format)) {
        std::cout << "format\t" << (ours ? std::string(name_of(*ours)) : "libcamera " + format.toString()) << '\t'
                  << size.width << '\t' << size.height << '\n';
      }
    }
  }
  for (const auto& [id, info] : camera.controls()) {
    // Named as in a configuration, which has keys of its own for exposure and gain.
    const bool exposure = id->id() == libcamera::controls::ExposureTime.id();
    const bool gain = id->id() == libcamera::controls::AnalogueGain.id();
    const auto low = number_in(info.min());
    const auto high = number_in(info.max());
    if (!low || !high) continue;
    std::vector<std::string> names = {exposure ? "exposure_us" : gain ? "gain" : id->name()};
    if (id->id() == libcamera::controls::ColourGains.id()) {
      names = {kRedGain, kBlueGain};
    } else if (is_array(*id)) {
      continue;
    }
    for (const std::string& name : names) {
      std::cout << "control\t" << name << '\t' << *low << '\t' << *high << '\t' << number_in(info.def()).value_or(*low)
                << '\n';
    }
  }
}

StreamSpec spec_of(int count, char** words) {
  StreamSpec spec{.width = std::atoi(words[0]), .height = std::atoi(words[1])};
  CameraSettings& settings = spec.settings;
  for (int i = 2; i < count; ++i) {
    const std::string word = words[i];
    const std::size_t equals = word.rfind('=');
    const std::string key = word.substr(0, equals), value = word.substr(equals + 1);
    if (key == "pixel_format") {
      settings.pixel_format = pixel_format_named(value);
    } else if (key == "rate_hz") {
      settings.rate_hz = std::stod(value);
    } else if (key == "exposure_us") {
      settings.exposure_us = std::stod(value);
    } else if (key == "gain") {
      settings.gain = std::stod(value);
    } else {
      settings.controls.emplace_back(key.substr(std::strlen("controls.")), std::stod(value));
    }
  }
  return spec;
}

void send(const HelperMessage& message, const std::vector<int>& descriptors = {}) {
  iovec piece{const_cast<HelperMessage*>(&message), sizeof message};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMaxPlanes * sizeof(int))> room{};
  msghdr header{};
  header.msg_iov = &piece;
  header.msg_iovlen = 1;
  if (!descriptors.empty()) {
    header.msg_control = room.data();
    header.msg_controllen = CMSG_SPACE(descriptors.size() * sizeof(int));
    cmsghdr* head = CMSG_FIRSTHDR(&header);
    head->cmsg_level = SOL_SOCKET;
    head->cmsg_type = SCM_RIGHTS;
    head->cmsg_len = CMSG_LEN(descriptors.size() * sizeof(int));
    std::memcpy(CMSG_DATA(head), descriptors.data(), descriptors.size() * sizeof(int));
  }
  if (sendmsg(kHelperSocket, &header, MSG_NOSIGNAL) < 0) _exit(0);  // the other end is closed
}

void set_text(HelperMessage& message, const std::string& text) {
  std::snprintf(message.text.data(), message.text.size(), "%s", text.c_str());
}

[[noreturn]] void refuse(HelperMessage::Kind kind, const char* why) {
  HelperMessage message{.kind = kind};
  set_text(message, why);
  send(message);
  _exit(0);
}

[[noreturn]] void open(const std::string& name, const StreamSpec& spec) {
  try {
    static Camera camera(name, spec, [](const HelperMessage& frame) { send(frame); });
    HelperMessage opened{.kind = HelperMessage::Kind::opened,
                         .format = camera.format(),
                         .stride = camera.stride(),
                         .buffers = static_cast<std::uint32_t>(camera.buffers().size())};
    for (const std::filesystem::path& node : nodes_of(camera.camera())) set_text(opened, usb_serial(node));
    send(opened);
    for (std::uint32_t i = 0; i < opened.buffers; ++i) {
      HelperMessage memory{.kind = HelperMessage::Kind::memory, .index = i};
      std::vector<int> descriptors;
      for (const libcamera::FrameBuffer::Plane& plane : camera.buffers()[i]->planes()) {
        memory.plane[memory.planes++] = {plane.offset, plane.length};
        descriptors.push_back(plane.fd.get());
      }
      send(memory, descriptors);
    }
    camera.start();
    std::uint32_t index = 0;
    while (recv(kHelperSocket, &index, sizeof index, 0) == sizeof index) camera.give_back(index);
  } catch (const CameraFault& e) {
    refuse(HelperMessage::Kind::unavailable, e.what());
  } catch (const InputError& e) {
    refuse(HelperMessage::Kind::unfit, e.what());
  }
  _exit(0);  // the kernel then closes the camera
}

}  // namespace
}  // namespace lumigraft::capture::libcam

int main(int count, char** words) {
  using namespace lumigraft;
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);  // aborts are expected
  if (count == 2 && std::strcmp(words[1], "list") == 0) {
    try {
      for (const auto& camera : capture::libcam::cameras()) capture::libcam::list(*camera);
    } catch (const capture::CameraFault& e) {
      std::cout << "failed\t" << e.what() << '\n';
    }
    return 0;
  }
  if (count >= 5 && std::strcmp(words[1], "open") == 0) {
    capture::libcam::open(words[2], capture::libcam::spec_of(count - 3, words + 3));
  }
  std::fputs("lumigraft_libcamera: started by lumigraft where a source is libcamera:\n", stderr);
  return 2;
}
