#pragma once
// What viewers want of a recording that is played: where it goes on, and whether it stands still. Any thread.
#include <mutex>
#include <optional>

#include "server/stream/protocol.h"

namespace lumigraft::server {

class Playback {
 public:
  struct State {
    double at_s = 0.0;      ///< of the newest picture, from the recording's beginning
    double length_s = 0.0;  ///< to its last picture, as far as it is known
    bool paused = false;
  };
  struct Orders {
    std::optional<double> at_s;
    bool paused = false;
    bool step = false;
  };

  void apply(const PlaybackCommand& command);
  /// Each order is given once, but for the pause.
  Orders take();
  void shown(double at_s, double length_s);
  /// Empty before the first picture, and for live cameras.
  std::optional<State> state() const;

 private:
  mutable std::mutex mutex_;
  Orders orders_;
  std::optional<State> state_;
};

}  // namespace lumigraft::server
