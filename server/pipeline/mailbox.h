#pragma once
// How stages on threads are joined: one item, the newest. Whoever is slow never holds up whoever is fast; what it
// could not take is dropped and counted, and the count carries the slow stage's name.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace lumigraft::server {

template <typename T>
class Mailbox {
 public:
  /// `reader` names the stage that takes from this box: the culprit when something is dropped.
  explicit Mailbox(std::string reader) : reader_(std::move(reader)) {}

  /// Replaces what nobody took. True when that dropped an item. Items put after close() vanish uncounted.
  bool put(T item) {
    bool dropped = false;
    {
      std::lock_guard lock(mutex_);
      if (closed_) {
        return false;
      }
      dropped = item_.has_value();
      dropped_ += dropped ? 1 : 0;
      item_ = std::move(item);
    }
    ready_.notify_one();
    return dropped;
  }

  /// Waits for an item. Empty: the timeout is over, or the box is closed.
  std::optional<T> take(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    ready_.wait_for(lock, timeout, [this] { return item_.has_value() || closed_; });
    if (closed_ || !item_) {
      return std::nullopt;
    }
    taken_.notify_all();
    T item = std::move(*item_);
    item_.reset();
    return item;
  }

  /// Waits until nothing lies in the box: the reader is ready for something newer. False when the timeout is over.
  bool wait_until_taken(std::chrono::milliseconds timeout) const {
    std::unique_lock lock(mutex_);
    return taken_.wait_for(lock, timeout, [this] { return !item_.has_value(); });
  }

  /// Wakes the reader for good; what lies in the box is forgotten.
  void close() {
    {
      std::lock_guard lock(mutex_);
      closed_ = true;
      item_.reset();
    }
    ready_.notify_all();
    taken_.notify_all();
  }

  const std::string& reader() const { return reader_; }
  std::uint64_t dropped() const {
    std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  const std::string reader_;
  mutable std::mutex mutex_;
  std::condition_variable ready_;
  mutable std::condition_variable taken_;
  std::optional<T> item_;
  std::uint64_t dropped_ = 0;
  bool closed_ = false;
};

}  // namespace lumigraft::server
