// fake_gige_camera ADDRESS SERIAL LOST [FAULT]: Aravis's camera of GigE Vision on a loopback address, losing that share
// of its packets. Says "running" once it is, and runs until it is killed. Of every eight pictures the network, as FAULT
// says, delivers one again ("repeating"), one after its successor ("swapping"), one 80 ms late ("late"), or all with
// their packets in the opposite order ("shuffling"). "forgetting" loses one packet of twenty for good, "resending"
// sends it when it is asked for, as Aravis's camera alone does not. "chunks" and what gige_chunks.h adds to it are
// chunks.
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
ArvFakeCamera* inside = nullptr;  ///< what the camera is without its network

/// Gathers the camera's packets picture by picture and delivers them as the fault wants. Of the camera's one thread.
class Network {
 public:
  void take(GSocket* socket, GSocketAddress* to, const gchar* packet, gsize size) {
    socket_ = socket;
    to_ = to;
    picture_.emplace_back(packet, packet + size);
    constexpr gsize kFormat = 4;  // of a packet of GVSP: 1 leader, 2 trailer, 3 data
    if (size > kFormat && (packet[kFormat] & 0x0F) == 2) {
      deliver_as_wanted();
      picture_.clear();
    }
  }

  /// A request of GVCP for packets that did not come: its picture's number, and those of the first and the last packet.
  void hear(const guint8* request, gsize size) const {
    constexpr gsize kHeader = 8;
    constexpr guint32 kResend = 0x40;
    if (fault != "resending" || size < kHeader + 12 || number_at(request, 2, 2) != kResend) {
      return;
    }
    const guint32 picture = number_at(request, kHeader + 2, 2);
    const guint32 first = number_at(request, kHeader + 4, 4), last = number_at(request, kHeader + 8, 4);
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

/// Answers to its client come from the one port of GigE Vision's control, pictures from any other.
bool is_picture(GSocket* socket) {
  constexpr guint16 kControl = 3956;
  GSocketAddress* from = g_socket_get_local_address(socket, nullptr);
  const guint16 port = from != nullptr ? g_inet_socket_address_get_port(G_INET_SOCKET_ADDRESS(from)) : kControl;
  g_clear_object(&from);
  return port != kControl;
}

}  // namespace

/// Stands before GLib's, so that what the camera sends passes through here.
extern "C" gssize g_socket_send_to(GSocket* socket, GSocketAddress* to, const gchar* packet, gsize size,
                                   GCancellable* cancellable, GError** error) {
  if (fault.empty() || !is_picture(socket)) {
    return Network::library()(socket, to, packet, size, cancellable, error);
  }
  network.take(socket, to, packet, size);
  return static_cast<gssize>(size);
}

/// And what it receives.
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

/// Aravis's own camera says what it is in a text that it holds.
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
    constexpr guint32 kCapability = 0x0934, kResendsPackets = 1 << 2;  // a client asks who says so alone
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
