#include "capture/live/live_source.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <utility>

#include "capture/error.h"
#include "capture/live/thread_priority.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kMostWaiting = 32;  ///< pictures nobody took; after that the oldest go

}  // namespace

LiveSource::LiveSource(std::string name, Open open, LivePatience patience)
    : name_(std::move(name)), open_(std::move(open)), patience_(patience) {
  // Of a camera's threads, the library's and ours, which take a few hundredths of a core: a picture waits for nobody.
  const RealtimeScope urgent;
  try {
    device_ = open_();
    serial_ = device_->serial();
  } catch (const CameraFault& e) {
    say(e.what());
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
  if (waiting_.empty()) {
    return std::nullopt;
  }
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
  return trouble_;
}

std::string LiveSource::take_warning() {
  const std::lock_guard lock(mutex_);
  return std::exchange(warning_, "");
}

void LiveSource::say(const std::string& fault) {
  const std::lock_guard lock(mutex_);
  trouble_ = fault.empty() ? "" : name_ + ": " + fault;
}

void LiveSource::rest(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, patience_.retry, [] { return false; });
}

void LiveSource::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    try {
      if (!device_) {
        rest(stop);
        if (stop.stop_requested()) {
          return;
        }
        device_ = open_();
        const std::lock_guard lock(mutex_);
        serial_ = device_->serial();
      }
      listen(stop);
    } catch (const std::exception& e) {
      say(e.what());
    }
    device_.reset();
  }
}

/// Until the camera is gone or silent.
void LiveSource::listen(const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kTick{50};
  clock_ = {};
  bracket_.clear();
  first_sequence_ = start_ = next_sequence_;
  learning_since_.reset();
  learnt_from_ = 0;
  const Clock::time_point opened = Clock::now();
  std::array<std::optional<Clock::time_point>, 3> last;  // a device of two streams may freeze in one of them
  std::string lost;                                      // why the newest picture was
  while (!stop.stop_requested()) {
    if (std::optional<SourceItem> item = device_->next(kTick)) {
      // Torn pictures alone are no sign of life that anybody could see.
      if (const auto* torn = std::get_if<LostPicture>(&*item)) {
        lost = torn->reason;
      } else {
        lost.clear();
        last[static_cast<std::size_t>(stream_of(*item))] = Clock::now();
        say("");
      }
      if (std::string warning = device_->take_warning(); !warning.empty()) {
        const std::lock_guard lock(mutex_);
        warning_ = std::move(warning);
      }
      accept(std::move(*item));
    } else if (device_->finished()) {
      const std::string reason = device_->fault();
      say((reason.empty() ? "the camera is gone" : reason) + ", it is looked for again");
      return;
    }
    Clock::time_point oldest = Clock::time_point::max();
    for (const auto& time : last) oldest = std::min(oldest, time.value_or(Clock::time_point::max()));
    if (Clock::now() - (oldest == Clock::time_point::max() ? opened : oldest) > patience_.silence) {
      say((lost.empty() ? "the camera gives no pictures" : "the camera gives no whole pictures (" + lost + ")") +
          ", it is opened again");
      return;
    }
  }
}

/// Where a clock stands is known from several pictures: the first alone may have been on its way for most of a period,
/// and would be paired with another one's neighbour.
bool LiveSource::learns_its_clock() {
  constexpr int kPictures = 5;
  constexpr std::chrono::milliseconds kLongest{200};  // to slow cameras a period is long
  if (device_->on_host_clock() || learnt_from_ >= kPictures) {
    return false;
  }
  learning_since_ = learning_since_.value_or(Clock::now());
  learnt_from_ = Clock::now() - *learning_since_ < kLongest ? learnt_from_ + 1 : kPictures;
  return learnt_from_ < kPictures;
}

void LiveSource::accept(SourceItem item) {
  const auto stream = static_cast<std::size_t>(stream_of(item));
  Stamp& stamp = std::visit([](auto& i) -> Stamp& { return i.stamp; }, item);
  if (std::holds_alternative<LostPicture>(item)) {
    stamp.time_ns = stamp.host_time_ns;  // that of a damaged picture may be another one's
  } else {
    constexpr std::int64_t kCredible_ns = 1'000'000'000;
    const std::int64_t device_ns = stamp.time_ns;
    stamp.time_ns = clock_.to_host(device_ns, stamp.host_time_ns);
    if (device_->on_host_clock() && device_ns > stamp.host_time_ns - kCredible_ns) {
      stamp.time_ns = std::min(stamp.time_ns, device_ns);  // some drivers' stamps lie after the arrival
    }
  }
  stamp.sequence += first_sequence_[stream];
  next_sequence_[stream] = std::max(next_sequence_[stream], stamp.sequence + 1);
  bracket_.push_back(std::move(item));
  if (device_->bracket_incomplete()) {
    return;  // nobody shall see half of it
  }
  if (learns_its_clock()) {
    for (const SourceItem& early : bracket_) {  // as if it had never been
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
    while (waiting_.size() > kMostWaiting) {
      waiting_.pop_front();
    }
  }
  changed_.notify_one();
}

}  // namespace lumigraft::capture
