#include "server/pipeline/playback.h"

namespace lumigraft::server {

void Playback::apply(const PlaybackCommand& command) {
  const std::lock_guard lock(mutex_);
  if (command.at_s) orders_.at_s = command.at_s;
  orders_.paused = command.paused.value_or(orders_.paused);
  orders_.step = orders_.step || command.step;
}

Playback::Orders Playback::take() {
  const std::lock_guard lock(mutex_);
  const Orders orders = orders_;
  orders_ = {.at_s = std::nullopt, .paused = orders.paused, .step = false};
  return orders;
}

void Playback::shown(double at_s, double length_s) {
  const std::lock_guard lock(mutex_);
  state_ = {at_s, length_s, false};
}

std::optional<Playback::State> Playback::state() const {
  const std::lock_guard lock(mutex_);
  std::optional<State> state = state_;
  if (state) state->paused = orders_.paused;
  return state;
}

}  // namespace lumigraft::server
