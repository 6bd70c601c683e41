#pragma once
// Queue of one stream's items in the order of their times, with notes of missing, lost and misordered ones.
#include <chrono>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "capture/source.h"

namespace lumigraft::capture {

constexpr std::int64_t kLatest_ns = 4'000'000'000'000'000'000;  ///< year 2096: sums with bounds cannot overflow

inline bool is_lost(const SourceItem& item) { return std::holds_alternative<LostFrame>(item); }
inline std::int64_t time_of(const SourceItem& item) { return stamp_of(item).time_ns; }

/// For warnings, rounded.
inline std::string ms_text(std::int64_t ns) { return std::to_string((ns + 500'000) / 1'000'000) + " ms"; }

struct StreamLane {
  using Clock = std::chrono::steady_clock;
  struct Entry {
    SourceItem item;
    Clock::time_point arrived;
    std::vector<std::string> notes;  ///< warnings about items before it
  };

  Source* source = nullptr;
  std::int64_t offset_ns = 0;  ///< added to the times of its items
  std::deque<Entry> queue;
  std::int64_t last_time_ns = std::numeric_limits<std::int64_t>::min();  ///< of the newest item that arrived
  std::uint64_t next_sequence = 0;                                       ///< expected if nothing is lost
  std::vector<std::string> notes;                                        ///< for the next Entry
  std::deque<std::int64_t> periods_ns;                                   ///< the newest between two items
  int dropped = 0;                                                       ///< by keep_newest; reset by who reports it

  /// Appends an item to the queue, or drops it with a note if its time goes back. Fish-eye frames of one time are a
  /// bracket.
  void accept(SourceItem item, Clock::time_point now = Clock::now());
  /// The usual time between two items; empty before the second.
  std::optional<std::int64_t> period_ns() const;
  /// Drops the oldest items and notes beyond `count`.
  void keep_newest(std::size_t count);
  /// Removes the front of the queue; its notes, and its loss if it is lost, become warnings.
  SourceItem pop(std::vector<std::string>& warnings);
};

}  // namespace lumigraft::capture
