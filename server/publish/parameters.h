#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.
#include <chrono>

namespace lumigraft::server {
inline constexpr struct PublishParameters {
  /// Pictures that wait longer are dropped: whoever watches wants new ones, and the network has stalled.
  std::chrono::milliseconds max_wait{1000};
  /// Until a connection attempt and a write count as failed: as long as TCP needs for three lost packets.
  std::chrono::seconds open_patience{10}, write_patience{5};
  std::chrono::seconds first_pause{1}, longest_pause{30};  ///< before the next attempt; doubles
  std::chrono::seconds settled{10};  ///< a connection that lasted so long was good: the next pause is the first again
  std::chrono::milliseconds goodbye{100};  ///< for the end of the stream to be sent
  int packet_bytes = 1200;  ///< of RTP: media servers send packets on as they are, with a header of encryption more
} kPublish;
}  // namespace lumigraft::server
