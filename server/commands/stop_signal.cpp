#include "server/commands/stop_signal.h"

#include <unistd.h>

#include <csignal>
#include <thread>

#include "server/commands/parameters.h"

namespace lumigraft::server {

StopSignal::StopSignal() {
  std::signal(SIGPIPE, SIG_IGN);  // a closed connection is reported as an error code
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::thread([this, set] {
    int number = 0;
    sigwait(&set, &number);
    came();
    // A second signal ends the process at once. The first waits only stop_patience: a solver or a software GPU may be
    // in a call that cannot be interrupted, and its result is not needed.
    const timespec patience{0, std::chrono::nanoseconds(kCommands.stop_patience).count()};
    sigtimedwait(&set, nullptr, &patience);
    _exit(0);
  }).detach();
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

bool StopSignal::wait(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, timeout, [this] { return came_; });
}

}  // namespace lumigraft::server
