#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace lumigraft::server {
inline constexpr struct StreamParameters {
  double max_position_m = 100, max_at_s = 1e7;  ///< in commands: of objects; in a recording
  double max_pixel = 65535;                     ///< in which a pixel is picked
  std::size_t max_name_bytes = 200, max_body_bytes = 1024;
  /// H.264 frames of a viewer that wait: each is a period older when it is shown, and a third asks for a key frame.
  std::size_t max_queued = 2;
  std::size_t remembered_frames = 256;  ///< whose capture time is known
  /// Frames sent but not acknowledged, at most: half a second at 30 Hz, more than any network's round trip.
  std::size_t max_in_flight = 16;
  std::chrono::milliseconds ack_patience{1000};  ///< until a frame that is not acknowledged counts as lost, at first
  std::chrono::seconds window_stays{30};         ///< after a queue was seen: it is tried again twice a minute
  std::uint32_t max_header_bytes = 8 * 1024;     ///< of a request
  std::int64_t key_every_ns = 2'000'000'000;
  /// Between key frames on request: a viewer that requests them continuously must not reduce the others' quality.
  /// Between states that are sent. For viewers to receive the end of the stream.
  std::chrono::milliseconds keys_apart{500}, states_apart{50}, goodbye{100};
  /// Failed attempts of one address to log in, within so long; 64 bits of a token last for ever at this rate.
  std::ptrdiff_t max_attempts = 10;
  double attempts_within_s = 60, login_lasts_s = 12 * 3600;  ///< a working day
  std::size_t remembered_attempts = 4096;                    ///< of all addresses
  std::size_t max_logins = 256;                              ///< the oldest ends
  double commands_per_s = 30, max_commands = 60;             ///< of a viewer, as a page that drags sends; and at once
  int send_buffer_bytes = 256 * 1024;  ///< kernel buffer for a slow viewer: a quarter second of stream
} kStream;
}  // namespace lumigraft::server
