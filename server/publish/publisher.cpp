#include "server/publish/publisher.h"

#include <pthread.h>

extern "C" {
#include <libavutil/log.h>
}

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "server/publish/parameter_sets.h"
#include "server/publish/parameters.h"

namespace lumigraft::server {

Publisher::Publisher(PublishUrl url, EncoderDemand& demand, Metrics& metrics)
    : url_(std::move(url)), demand_(demand), metrics_(metrics) {
  av_log_set_level(AV_LOG_QUIET);  // this program reports errors itself, and without passwords
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Publisher::~Publisher() { stop(); }

void Publisher::stop() { thread_.request_stop(); }

void Publisher::offer(std::shared_ptr<const StreamMessage> message) {
  {
    std::lock_guard lock(mutex_);
    if (!wanted_) return;
    // Those before the first key frame are not dropped: nobody watches yet.
    const bool begun = !queue_.needs_key();
    const std::size_t dropped = queue_.offer(std::move(message), Clock::now());
    if (begun && dropped > 0) metrics_.drop("publish", dropped);
    if (queue_.needs_key()) demand_.key = true;
  }
  changed_.notify_all();
}

std::optional<std::string> Publisher::warning() const {
  std::lock_guard lock(mutex_);
  return warning_;
}

void Publisher::demand(bool wanted) {
  std::lock_guard lock(mutex_);
  wanted_ = wanted;
  queue_.restart();
  if (wanted) demand_.key = true;
  demand_.publishing = wanted;
}

PublishQueue::Picture Publisher::next(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  PublishQueue::Picture picture;
  changed_.wait(lock, stop, [&] { return (picture = queue_.take()) != nullptr; });
  return stop.stop_requested() ? nullptr : picture;
}

void Publisher::pause(Clock::duration duration, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, duration, [] { return false; });
}

std::unique_ptr<MediaOutput> Publisher::connect(const StreamMessage& first,
                                                std::span<const std::uint8_t> parameter_sets,
                                                const std::stop_token& stop) {
  const StreamHeader& header = first.header;
  auto output = std::make_unique<MediaOutput>(
      url_, MediaOutput::Format{header.width, header.height, parameter_sets, header.capture_time_ns, first.captured},
      stop);
  connected_ = Clock::now();
  metrics_.publish_connected(true);
  std::fprintf(stderr, "lumigraft: publishing to %s\n", url_.shown.c_str());
  std::lock_guard lock(mutex_);
  warning_.reset();
  return output;
}

/// Connects and publishes until stop is requested, or something fails: then returns what.
std::string Publisher::publish(const std::stop_token& stop) {
  std::unique_ptr<MediaOutput> output;
  std::vector<std::uint8_t> announced;
  try {
    while (const PublishQueue::Picture picture = next(stop)) {
      const auto unit = std::span(picture->bytes).subspan(kStreamHeaderBytes);
      const bool key = picture->header.kind == StreamKind::h264_key;
      if (std::vector<std::uint8_t> sets = key ? parameter_sets(unit) : announced; !output || sets != announced) {
        output.reset();  // of another size: receivers must be told
        output = connect(*picture, sets, stop);
        announced = std::move(sets);
      }
      output->write(unit, key, picture->captured);
      metrics_.published();
    }
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return {};
}

void Publisher::run(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "publish");  // for `top -H`
  Clock::duration wait = kPublish.first_pause;
  while (!stop.stop_requested()) {
    connected_ = Clock::time_point::max();
    demand(true);
    const std::string failure = publish(stop);
    demand(false);
    metrics_.publish_connected(false);
    if (stop.stop_requested()) return;
    {
      std::lock_guard lock(mutex_);
      warning_ = "publish: " + url_.shown + ": " + failure + "; tried again";
    }
    if (connected_ < Clock::now() - kPublish.settled) wait = kPublish.first_pause;
    pause(wait, stop);
    wait = std::min<Clock::duration>(2 * wait, kPublish.longest_pause);
  }
}

}  // namespace lumigraft::server
