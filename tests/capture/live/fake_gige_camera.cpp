// fake_gige_camera ADDRESS SERIAL LOST [FAULT]: Aravis's fake GigE Vision camera on a loopback address, losing the
// fraction LOST of its packets. Prints "running" once it runs, and runs until it is killed. FAULT is a fault of the
// network. In one frame of eight: "repeating" delivers it twice, "swapping" after its successor, "late" 80 ms late. In
// all frames: "shuffling" reverses the order of packets, "forgetting" loses one packet of twenty permanently,
// "resending" sends it when it is requested, which Aravis's camera cannot. "chunks" and others: see gige_chunks.h.
#include <arv.h>
#include <dlfcn.h>
#include <glib/gstdio.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "tests/capture/live/gige_chunks.h"

namespace {

using lumigraft::test::GigeChunks;

using Receive = gssize (*)(GSocket*, GSocketAddress**, GInputVector*, gint, GSocketControlMessage***, gint*, gint*,
                           GCancellable*, GError**);
using Send = gssize (*)(GSocket*, GSocketAddress*, const gchar*, gsize, GCancellable*, GError**);

std::string fault;
std::optional<GigeChunks> chunks;
ArvFakeCamera* inside = nullptr;  ///< the camera without its network

/// Collects the packets of each frame and delivers them with the fault. Used by the camera's single thread.
class Network {
 public:
  void take(GSocket* socket, GSocketAddress* to, const gchar* packet, gsize size) {
    socket_ = socket;
    to_ = to;
    picture_.emplace_back(packet, packet + size);
    constexpr gsize kFormat = 4;  // offset of the format in a GVSP packet: 1 leader, 2 trailer, 3 data
    if (size > kFormat && (packet[kFormat] & 0x0F) == 2) {
      deliver_as_wanted();
      picture_.clear();
    }
  }

  /// A GVCP request for missing packets: frame ID, first and last packet.
  void hear(const guint8* request, gsize size) const {
    constexpr gsize kRequestHeader = 8;
    constexpr guint32 kResend = 0x40;
    if (fault != "resending" || size < kRequestHeader + 12 || number_at(request, 2, 2) != kResend) {
      return;
    }
    const guint32 picture = number_at(request, kRequestHeader + 2, 2);
    const guint32 first = number_at(request, kRequestHeader + 4, 4), last = number_at(request, kRequestHeader + 8, 4);
    for (const Packets& packets : delivered_) {
      for (const auto& packet : packets) {
        const auto* bytes = reinterpret_cast<const guint8*>(packet.data());
        const guint32 number = number_at(bytes, 5, 3);
        if (number_at(bytes, 2, 2) == picture && number >= first && number <= last) {
          library()(socket_, to_, packet.data(), packet.size(), nullptr, nullptr);
        }
      }
    }
  }

  static Send library() {
    static const auto send = reinterpret_cast<Send>(dlsym(RTLD_NEXT, "g_socket_send_to"));
    return send;
  }

 private:
  using Packets = GigeChunks::Packets;

  static guint32 number_at(const guint8* bytes, gsize from, gsize count) {
    guint32 number = 0;
    for (gsize i = from; i < from + count; ++i) {
      number = number << 8 | bytes[i];
    }
    return number;
  }

  void deliver_as_wanted() {
    constexpr int kPeriod = 8;
    constexpr gulong kLate_us = 80'000, kSoon_us = 10'000;
    const bool faulty = number_++ % kPeriod == kPeriod - 1;
    if (chunks) {
      picture_ = chunks->with_chunks(picture_, inside);
    }
    if (fault == "shuffling") {
      std::reverse(picture_.begin(), picture_.end());
    } else if (fault == "late" && faulty) {
      g_usleep(kLate_us);
    } else if (fault == "swapping" && faulty) {
      held_.swap(picture_);
      return;
    }
    deliver(picture_);
    if (fault == "repeating" && faulty) {
      g_usleep(kSoon_us);
      deliver(picture_);
    }
    deliver(held_);
    held_.clear();
  }

  void deliver(const Packets& packets) {
    constexpr int kLost = 20;
    constexpr std::size_t kKept = 4;
    for (const auto& packet : packets) {
      if ((fault != "forgetting" && fault != "resending") || ++packets_ % kLost != 0) {
        library()(socket_, to_, packet.data(), packet.size(), nullptr, nullptr);
      }
    }
    delivered_.push_back(packets);
    if (delivered_.size() > kKept) {
      delivered_.pop_front();
    }
  }

  GSocket* socket_ = nullptr;
  GSocketAddress* to_ = nullptr;
  Packets picture_, held_;
  std::deque<Packets> delivered_;
  int number_ = 0, packets_ = 0;
};

Network network;

/// Control messages are sent from the GigE Vision control port, frames from another one.
bool is_picture(GSocket* socket) {
  constexpr guint16 kControl = 3956;
  GSocketAddress* from = g_socket_get_local_address(socket, nullptr);
  const guint16 port = from != nullptr ? g_inet_socket_address_get_port(G_INET_SOCKET_ADDRESS(from)) : kControl;
  g_clear_object(&from);
  return port != kControl;
}

}  // namespace

/// Replaces GLib's function to intercept what the camera sends.
extern "C" gssize g_socket_send_to(GSocket* socket, GSocketAddress* to, const gchar* packet, gsize size,
                                   GCancellable* cancellable, GError** error) {
  if (fault.empty() || !is_picture(socket)) {
    return Network::library()(socket, to, packet, size, cancellable, error);
  }
  network.take(socket, to, packet, size);
  return static_cast<gssize>(size);
}

/// As above, for what the camera receives.
extern "C" gssize g_socket_receive_message(GSocket* socket, GSocketAddress** from, GInputVector* vectors, gint count,
                                           GSocketControlMessage*** messages, gint* message_count, gint* flags,
                                           GCancellable* cancellable, GError** error) {
  static const auto library = reinterpret_cast<Receive>(dlsym(RTLD_NEXT, "g_socket_receive_message"));
  const gssize size = library(socket, from, vectors, count, messages, message_count, flags, cancellable, error);
  if (size > 0) {
    network.hear(static_cast<const guint8*>(vectors[0].buffer), static_cast<gsize>(size));
  }
  return size;
}

/// Replaces the GenICam description in the fake camera.
ArvGvFakeCamera* camera_with_chunks(const char* address, const char* serial) {
  ArvFakeCamera* plain = arv_fake_camera_new(serial);
  std::size_t size = 0;
  const char* xml = arv_fake_camera_get_genicam_xml(plain, &size);
  const std::string described = chunks->described({xml, size});
  g_object_unref(plain);
  gchar* path = nullptr;
  const gint file = g_file_open_tmp("lumigraft-gige-XXXXXX.xml", &path, nullptr);
  if (described.empty() || file < 0 || !g_file_set_contents(path, described.c_str(), -1, nullptr)) {
    return nullptr;
  }
  ArvGvFakeCamera* camera = arv_gv_fake_camera_new_full(address, serial, path);
  g_remove(path);
  g_free(path);
  return camera;
}

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    return 2;
  }
  fault = argc > 4 ? argv[4] : "";
  if (fault.starts_with("chunks")) {
    chunks.emplace(fault);
  }
  ArvGvFakeCamera* camera = chunks ? camera_with_chunks(argv[1], argv[2]) : arv_gv_fake_camera_new(argv[1], argv[2]);
  if (camera == nullptr) {
    return 1;
  }
  g_object_set(camera, "gvsp-lost-ratio", std::atof(argv[3]), nullptr);
  if (!arv_gv_fake_camera_is_running(camera)) {
    return 1;
  }
  inside = arv_gv_fake_camera_get_fake_camera(camera);
  if (chunks) {
    chunks->set_up(inside);
  }
  if (fault == "resending") {
    constexpr guint32 kCapability = 0x0934,
                      kResendsPackets = 1 << 2;  // clients request packets only from cameras with this capability
    guint32 offered = 0;
    arv_fake_camera_read_register(inside, kCapability, &offered);
    arv_fake_camera_write_register(inside, kCapability, offered | kResendsPackets);
  }
  std::puts("running");
  std::fflush(stdout);
  for (;;) {
    g_usleep(1'000'000);
  }
}
