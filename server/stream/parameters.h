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
  /// Of a bounded H.264 stream: what a picture after smaller ones may take, in time of the stream, so that a key frame
  /// delays those behind it by no more. Half of it makes key frames visibly coarser than the pictures around them.
  double burst_s = 0.25;
  double shortest_period_s = 1.0 / 120, longest_period_s = 0.5;  ///< between its pictures, as far as bits are shared
  /// NetworkRate. A wait is more than processing on a busy machine takes and than age may grow. Samples: see there.
  double longest_wait_s = 0.15, freezing_wait_s = 0.3, rate_quantile = 0.8;
  std::size_t telling_bytes = 8 * 1024;  ///< fewer arrive at once wherever pictures can be shown at all
  double share_of_rate = 0.8, bound_in_use = 0.7, growth_per_s = 0.05, busy_network = 0.9;
  std::chrono::seconds rate_remembered{3}, shortest_trip_remembered{60};
  std::size_t max_unconfirmed = 64;
  /// Between looks at all viewers' networks.
  std::chrono::milliseconds networks_apart{200};
  /// Until a viewer of the smaller stream tries the larger one again, at first and at most.
  std::chrono::seconds first_retry{30}, last_retry{480};
  int unsent_bytes =
      16 * 1024;  ///< in the kernel's buffer, before more is written: what waits there cannot be replaced
  double commands_per_s = 30, max_commands = 60;  ///< of a viewer, as a page that drags sends; and at once
  int send_buffer_bytes = 256 * 1024;             ///< kernel buffer for a slow viewer: a quarter second of stream
} kStream;
}  // namespace lumigraft::server
