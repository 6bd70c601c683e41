#pragma once
// Playback commands of viewers for a recording (seek, pause, step), and its playback state. Any thread.
#include <mutex>
#include <optional>

#include "server/stream/protocol.h"

namespace lumigraft::server {

class Playback {
 public:
  struct State {
    double at_s = 0.0;      ///< of the newest frame, from the recording's beginning
    double length_s = 0.0;  ///< to its last frame, as far as known
    bool paused = false;
  };
  struct Orders {
    std::optional<double> at_s;
    bool paused = false, step = false;
  };

  void apply(const PlaybackCommand& command);
  /// Returns the orders and clears all but `paused`.
  Orders take();
  void shown(double at_s, double length_s);
  /// Empty before the first frame, and for live cameras.
  std::optional<State> state() const;

 private:
  mutable std::mutex mutex_;
  Orders orders_;
  std::optional<State> state_;
};

}  // namespace lumigraft::server
