#include "capture/live/live_source.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "capture/error.h"
#include "capture/live/thread_priority.h"

namespace lumigraft::capture {

LiveSource::LiveSource(std::string name, Open open, LivePatience patience)
    : name_(std::move(name)), open_(std::move(open)), patience_(patience) {
  // Threads started from here, the library's and this object's, inherit the priority. They use a few percent of a core,
  // and a delay would be measured as latency of the camera's clock.
  const RealtimeScope realtime;
  try {
    device_ = open_();
    serial_ = device_->serial();
  } catch (const CameraFault& e) {
    set_fault(e.what());
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

LiveSource::~LiveSource() {
  thread_.request_stop();
  thread_.join();
}

std::optional<SourceItem> LiveSource::next(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [this] { return !waiting_.empty(); });
  if (waiting_.empty()) return std::nullopt;
  SourceItem item = std::move(waiting_.front());
  waiting_.pop_front();
  return item;
}

std::string LiveSource::serial() const {
  const std::lock_guard lock(mutex_);
  return serial_;
}

std::string LiveSource::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

std::string LiveSource::take_warning() {
  const std::lock_guard lock(mutex_);
  return std::exchange(warning_, "");
}

void LiveSource::set_fault(const std::string& fault) {
  const std::lock_guard lock(mutex_);
  fault_ = fault.empty() ? "" : name_ + ": " + fault;
}

void LiveSource::wait_before_retry(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, patience_.retry, [] { return false; });
}

void LiveSource::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    try {
      if (!device_) {
        wait_before_retry(stop);
        if (stop.stop_requested()) return;
        device_ = open_();
        const std::lock_guard lock(mutex_);
        serial_ = device_->serial();
      }
      read_frames(stop);
    } catch (const std::exception& e) {
      set_fault(e.what());
    }
    device_.reset();
  }
}

/// Returns when the camera is gone or delivers no frames any more.
void LiveSource::read_frames(const std::stop_token& stop) {
  clock_ = {};
  bracket_.clear();
  first_sequence_ = start_ = next_sequence_;
  settling_since_.reset();
  clock_frames_ = 0;
  const Clock::time_point opened = Clock::now();
  std::array<std::optional<Clock::time_point>, 3> last;  // a device of two streams may freeze in one of them
  std::string lost;                                      // why the newest frame was lost
  while (!stop.stop_requested()) {
    if (std::optional<SourceItem> item = device_->next(kLiveParameters.poll)) {
      // A camera that delivers only damaged frames counts as silent.
      if (const auto* damaged = std::get_if<LostFrame>(&*item)) {
        lost = damaged->reason;
      } else {
        lost.clear();
        last[static_cast<std::size_t>(stream_of(*item))] = Clock::now();
        set_fault("");
      }
      if (std::string warning = device_->take_warning(); !warning.empty()) {
        const std::lock_guard lock(mutex_);
        warning_ = std::move(warning);
      }
      accept(std::move(*item));
    } else if (device_->finished()) {
      const std::string reason = device_->fault();
      set_fault((reason.empty() ? "the camera is disconnected" : reason) + ", it is searched for again");
      return;
    }
    Clock::time_point oldest = Clock::time_point::max();
    for (const auto& time : last) oldest = std::min(oldest, time.value_or(Clock::time_point::max()));
    if (Clock::now() - (oldest == Clock::time_point::max() ? opened : oldest) > patience_.silence) {
      set_fault("the camera delivers no " + (lost.empty() ? "frames" : "intact frames (" + lost + ")") +
                ", it is opened again");
      return;
    }
  }
}

/// True while the offset of the device's clock is not known well enough to pair its frames; counts the frame.
bool LiveSource::clock_settling() {
  constexpr int kFrames = kLiveParameters.clock_frames;
  if (device_->on_host_clock() || clock_frames_ >= kFrames) return false;
  settling_since_ = settling_since_.value_or(Clock::now());
  clock_frames_ = Clock::now() - *settling_since_ < kLiveParameters.clock_time ? clock_frames_ + 1 : kFrames;
  return clock_frames_ < kFrames;
}

void LiveSource::accept(SourceItem item) {
  const auto stream = static_cast<std::size_t>(stream_of(item));
  Stamp& stamp = std::visit([](auto& i) -> Stamp& { return i.stamp; }, item);
  if (std::holds_alternative<LostFrame>(item)) {
    stamp.time_ns = stamp.host_time_ns;  // the device time of a damaged frame may be wrong
  } else {
    const std::int64_t device_ns = stamp.time_ns;
    stamp.time_ns = clock_.to_host(device_ns, stamp.host_time_ns);
    if (device_->on_host_clock() && device_ns > stamp.host_time_ns - kLiveParameters.max_latency_ns) {
      stamp.time_ns = std::min(stamp.time_ns, device_ns);  // some drivers report times after the arrival
    }
  }
  stamp.sequence += first_sequence_[stream];
  next_sequence_[stream] = std::max(next_sequence_[stream], stamp.sequence + 1);
  bracket_.push_back(std::move(item));
  if (device_->bracket_incomplete()) return;  // a bracket is delivered as a whole
  if (clock_settling()) {
    for (const SourceItem& early : bracket_) {  // dropped frames leave no gap in the sequence numbers
      const auto of = static_cast<std::size_t>(stream_of(early));
      first_sequence_[of] -= next_sequence_[of] - start_[of];
      next_sequence_[of] = start_[of];
    }
    bracket_.clear();
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    std::move(bracket_.begin(), bracket_.end(), std::back_inserter(waiting_));
    bracket_.clear();
    while (waiting_.size() > kLiveParameters.max_queued) waiting_.pop_front();
  }
  changed_.notify_one();
}

}  // namespace lumigraft::capture
