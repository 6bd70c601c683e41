#pragma once
// A connection to a media server that H.264 is written to with libavformat: RTSP over TCP (ANNOUNCE), MPEG-TS over SRT,
// or RTP over UDP.
//
// Every call ends: it throws std::runtime_error when the peer has not answered in time, or soon after stop is requested
// (except while a host name is resolved). Messages never contain the URL, which may hold a password.
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>

#include "server/publish/publish_url.h"

namespace lumigraft::server {

class MediaOutput {
 public:
  struct Format {
    int width = 0, height = 0;
    std::span<const std::uint8_t> parameter_sets;          ///< Annex B; not empty
    std::int64_t first_time_ns = 0;                        ///< capture of the first picture, since 1970 UTC
    std::chrono::steady_clock::time_point first_captured;  ///< the same moment
  };
  /// Connects.
  MediaOutput(const PublishUrl& url, const Format& format, std::stop_token stop);
  ~MediaOutput();  ///< says goodbye, without waiting for an answer

  /// An access unit in Annex B. Time stamps are times of capture, also where the machine's clock is set meanwhile.
  void write(std::span<const std::uint8_t> annex_b, bool key, std::chrono::steady_clock::time_point captured);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
