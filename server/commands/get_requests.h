#pragma once
// Answers GET requests of a running service: docs/service.md lists the paths.
#include <chrono>
#include <string>
#include <string_view>

#include "server/metrics/metrics.h"
#include "server/pipeline/pipeline.h"
#include "server/publish/watch_url.h"
#include "server/stream/encode_jpeg.h"
#include "server/stream/web_server.h"

namespace lumigraft::server {

class GetRequests {
 public:
  GetRequests(Pipeline& pipeline, const Metrics& metrics, WatchUrl watch, int jpeg_quality)
      : pipeline_(pipeline), metrics_(metrics), watch_(std::move(watch)), encoder_(jpeg_quality) {}

  /// On the network thread.
  WebReply answer(std::string_view path);
  /// Of /snapshot.jpg: encodes, hence on a thread of its own.
  WebReply snapshot();

 private:
  WebReply map(std::string_view path);
  WebReply watch(std::string_view path) const;

  Pipeline& pipeline_;
  const Metrics& metrics_;
  const WatchUrl watch_;
  JpegEncoder encoder_;                              ///< used by snapshot() only, and so is
  std::string snapshot_;                             ///< this, a JPEG file, and
  std::chrono::steady_clock::time_point encoded_{};  ///< this
};

}  // namespace lumigraft::server
