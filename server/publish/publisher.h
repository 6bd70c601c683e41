#pragma once
// Publishes the H.264 stream to a media server, which serves it to any number of viewers.
//
// It has a thread of its own and a bounded queue: a peer that is slow, gone or silent delays neither the encoder nor
// the viewers of the websocket. It asks for H.264 while it is connected or tries to connect, since what connects needs
// a key frame, and not while it waits for the next attempt: nothing is encoded for a server that is away.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <thread>

#include "server/metrics/metrics.h"
#include "server/publish/media_output.h"
#include "server/publish/publish_queue.h"
#include "server/publish/publish_url.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

class Publisher {
 public:
  Publisher(PublishUrl url, EncoderDemand& demand, Metrics& metrics);
  ~Publisher();  ///< stops and joins

  /// Of the encode thread. Never waits for the network.
  void offer(std::shared_ptr<const StreamMessage> message);
  /// Requests the thread to stop, without waiting.
  void stop();
  /// Why nothing is published at present. Any thread.
  std::optional<std::string> warning() const;

 private:
  using Clock = std::chrono::steady_clock;

  void run(const std::stop_token& stop);
  std::string publish(const std::stop_token& stop);
  std::unique_ptr<MediaOutput> connect(const StreamMessage& first, std::span<const std::uint8_t> parameter_sets,
                                       const std::stop_token& stop);
  PublishQueue::Picture next(const std::stop_token& stop);
  void demand(bool wanted);
  void pause(Clock::duration duration, const std::stop_token& stop);

  const PublishUrl url_;
  EncoderDemand& demand_;
  Metrics& metrics_;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  PublishQueue queue_;
  bool wanted_ = false;
  std::optional<std::string> warning_;

  Clock::time_point connected_{};  ///< used by the thread only
  std::jthread thread_;            ///< last: it uses the others
};

}  // namespace lumigraft::server
