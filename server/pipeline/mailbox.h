#pragma once
// Connection of two threads that holds one item, the newest. A slow stage never blocks a fast one: items that it did
// not take in time are dropped, and counted under the slow stage's name.
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
  /// `reader`: name of the stage that takes items from this box, to which dropped items are counted.
  explicit Mailbox(std::string reader) : reader_(std::move(reader)) {}

  /// Replaces an item that was not taken. True if that dropped one. Items put after close() are discarded, not counted.
  bool put(T item) {
    bool dropped = false;
    {
      std::lock_guard lock(mutex_);
      if (closed_) return false;
      dropped = item_.has_value();
      dropped_ += dropped ? 1 : 0;
      item_ = std::move(item);
    }
    ready_.notify_one();
    return dropped;
  }

  /// Waits for an item. Empty: timeout, or the box is closed.
  std::optional<T> take(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    ready_.wait_for(lock, timeout, [this] { return item_.has_value() || closed_; });
    if (closed_ || !item_) return std::nullopt;
    taken_.notify_all();
    T item = std::move(*item_);
    item_.reset();
    return item;
  }

  /// Waits until the box is empty, so that the reader takes a newer item next. False: timeout.
  bool wait_until_taken(std::chrono::milliseconds timeout) const {
    std::unique_lock lock(mutex_);
    return taken_.wait_for(lock, timeout, [this] { return !item_.has_value(); });
  }

  /// Wakes the reader and discards the item; the box stays closed.
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
