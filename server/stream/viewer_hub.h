#pragma once
// The set of connected viewers and the messages sent to all of them. Uses no sockets; called only on the web server's
// thread.
#include <cstdint>
#include <deque>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "server/metrics/metrics.h"
#include "server/stream/encoder_demand.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

/// A viewer's interface to the hub. Any of these calls may close the viewer and so remove it from the hub.
class Viewer {
 public:
  virtual ~Viewer() = default;
  virtual Codec codec() const = 0;
  virtual void offer(const std::shared_ptr<const StreamMessage>& message) = 0;
  virtual void offer_text(const std::string& kind, const std::string& text) = 0;
  virtual void close_all() = 0;
};

class ViewerHub {
 public:
  ViewerHub(EncoderDemand& demand, Metrics& metrics) : demand_(demand), metrics_(metrics) {}

  void add(std::shared_ptr<Viewer> viewer);
  void remove(const std::shared_ptr<Viewer>& viewer);
  std::size_t count() const { return viewers_.size(); }

  /// Recounts the demand; call after a viewer's codec changes.
  void count_demand();
  void publish(const std::shared_ptr<const StreamMessage>& message);
  void publish_text(const std::string& kind, const std::string& text);
  void close_all();
  /// Called when a viewer has displayed the frame: the time since capture goes to the metrics as capture_to_ack.
  void acknowledged(std::uint32_t sequence);
  /// The newest codec configuration message, sent to each new viewer; may be null.
  const std::shared_ptr<const StreamMessage>& config() const { return config_; }

 private:
  EncoderDemand& demand_;
  Metrics& metrics_;
  std::set<std::shared_ptr<Viewer>> viewers_;
  std::shared_ptr<const StreamMessage> config_;
  std::deque<std::pair<std::uint32_t, std::int64_t>>
      capture_times_ns_;  ///< of recent frames, with their sequence numbers
};

}  // namespace lumigraft::server
