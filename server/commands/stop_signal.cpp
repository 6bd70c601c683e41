#include "server/commands/stop_signal.h"

#include <unistd.h>

#include <thread>
#include <utility>

#include "server/commands/parameters.h"

namespace lumigraft::server {

StopSignal::StopSignal(bool reloads) {
  std::signal(SIGPIPE, SIG_IGN);  // a closed connection is reported as an error code
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  const sigset_t stops = set;
  if (reloads) sigaddset(&set, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::thread([this, set, stops] {
    wait_for_stop(set);
    came();
    end_process(stops);
  }).detach();
}

void StopSignal::wait_for_stop(const sigset_t& all) {
  for (int number = 0; sigwait(&all, &number) == 0 && number == SIGHUP;) {
    const std::lock_guard lock(mutex_);
    reload_ = true;
    changed_.notify_all();
  }
}

/// After all is saved it waits only stop_patience: a solver or a software GPU may be in a call that cannot be
/// interrupted, and its result is not needed.
void StopSignal::end_process(const sigset_t& signals) {
  using Clock = std::chrono::steady_clock;
  Clock::time_point end = Clock::now() + kCommands.save_patience;
  for (bool saving = true; Clock::now() < end;) {
    const timespec tick{0, std::chrono::nanoseconds(kCommands.tick).count()};
    if (sigtimedwait(&signals, nullptr, &tick) > 0) break;  // a second signal
    std::lock_guard lock(mutex_);
    if (!saving || !saved_) continue;
    saving = false;
    end = Clock::now() + kCommands.stop_patience;
  }
  _exit(0);
}

void StopSignal::came() {
  std::lock_guard lock(mutex_);
  if (!armed_) _exit(0);
  came_ = true;
  changed_.notify_all();  // under the lock: the woken thread may end the program and destroy this object
}

void StopSignal::arm() {
  std::lock_guard lock(mutex_);
  armed_ = true;
}

void StopSignal::saved() {
  std::lock_guard lock(mutex_);
  saved_ = true;
}

bool StopSignal::wait(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [this] { return came_ || reload_; });
  return came_;
}

bool StopSignal::take_reload() {
  const std::lock_guard lock(mutex_);
  return std::exchange(reload_, false);
}

}  // namespace lumigraft::server
