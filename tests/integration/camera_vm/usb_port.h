#pragma once
// A device on the kernel's emulated USB port (dummy_hcd, gadgetfs): its descriptors and its answers to requests.
#include <fcntl.h>
#include <linux/usb/ch9.h>
#include <linux/usb/gadgetfs.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace lumigraft::test {

using Bytes = std::vector<std::uint8_t>;

inline void put(Bytes& out, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) {
    out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
}

/// A descriptor begins with its own length.
inline void add(Bytes& out, Bytes body) {
  out.push_back(static_cast<std::uint8_t>(body.size() + 1));
  out.insert(out.end(), body.begin(), body.end());
}

/// Sets the real-time priority `steps` above the lowest. A real camera does not wait for its readers; and gadgetfs
/// mixes up requests if the host sends one before the last answer was read, which on one processor the priority
/// prevents.
inline void raise_priority(int steps) {
  const sched_param first{sched_get_priority_min(SCHED_FIFO) + steps};
  sched_setscheduler(0, SCHED_FIFO, &first);
}

class UsbPort {
 public:
  /// Plugs in a device with these configurations, for full and high speed, and this device descriptor.
  UsbPort(const Bytes& full_speed, const Bytes& high_speed, const Bytes& device) {
    for (const auto& entry : std::filesystem::directory_iterator("/dev/gadget")) {
      file_ = ::open(entry.path().c_str(), O_RDWR);
    }
    Bytes hello;
    put(hello, 0, 4);
    for (const Bytes& part : {full_speed, high_speed, device}) {
      hello.insert(hello.end(), part.begin(), part.end());
    }
    plugged_ = file_ >= 0 && ::write(file_, hello.data(), hello.size()) == static_cast<ssize_t>(hello.size());
  }
  bool plugged() const { return plugged_; }

  /// Runs until the kernel removes the port. `answer` must call refuse, acknowledge, reply or receive.
  void serve(const std::function<void(const usb_ctrlrequest&)>& answer, const std::function<void()>& disconnected) {
    std::array<usb_gadgetfs_event, 5> events;
    for (;;) {
      const ssize_t got = ::read(file_, events.data(), sizeof events);
      if (got < 0 && errno != EINTR) {
        return;
      }
      for (std::size_t i = 0; i < static_cast<std::size_t>(std::max<ssize_t>(got, 0)) / sizeof events[0]; ++i) {
        if (events[i].type == GADGETFS_SETUP) {
          answer(events[i].u.setup);
        } else if (events[i].type == GADGETFS_DISCONNECT) {
          disconnected();
        }
      }
    }
  }

  void refuse(const usb_ctrlrequest& q) {
    char none = 0;
    [[maybe_unused]] const ssize_t stalls =
        (q.bRequestType & USB_DIR_IN) != 0 ? ::read(file_, &none, 0) : ::write(file_, &none, 0);
  }
  void acknowledge() { [[maybe_unused]] const ssize_t done = ::read(file_, nullptr, 0); }
  void reply(const usb_ctrlrequest& q, Bytes data) {
    data.resize(std::min<std::size_t>(data.size(), q.wLength));
    [[maybe_unused]] const ssize_t sent = ::write(file_, data.data(), data.size());
  }
  Bytes receive(const usb_ctrlrequest& q) {
    Bytes data(q.wLength);
    data.resize(static_cast<std::size_t>(std::max<ssize_t>(::read(file_, data.data(), data.size()), 0)));
    return data;
  }
  /// Replies with the string of a descriptor's index; index 0 is the list of languages.
  void reply_text(const usb_ctrlrequest& q, const std::array<const char*, 4>& texts) {
    const std::string text = texts[q.wValue & 3];
    Bytes body{USB_DT_STRING};
    if ((q.wValue & 3) == 0) {
      put(body, 0x0409, 2);
    }
    for (const char c : text) {
      put(body, static_cast<std::uint8_t>(c), 2);
    }
    Bytes out;
    add(out, body);
    reply(q, out);
  }

 private:
  int file_ = -1;
  bool plugged_ = false;
};

}  // namespace lumigraft::test
