#pragma once
// One stream's items as its source gave them, waiting to be used: in the order of their times, with a note for whatever
// is missing, lost or out of order.
#include <cstdint>
#include <deque>
#include <limits>
#include <string>
#include <vector>

#include "capture/source.h"

namespace lumigraft::capture {

constexpr std::int64_t kLatest_ns = 4'000'000'000'000'000'000;  ///< the year 2096; sums with bounds cannot overflow

bool is_lost(const SourceItem& item);
std::int64_t time_of(const SourceItem& item);

std::string ms_text(std::int64_t ns);  ///< for warnings, rounded

struct StreamLane {
  struct Entry {
    SourceItem item;
    std::vector<std::string> notes;  ///< warnings about what came before it
  };

  Source* source = nullptr;
  std::int64_t offset_ns = 0;  ///< added to the times of its items
  std::deque<Entry> queue;
  std::int64_t last_time_ns = std::numeric_limits<std::int64_t>::min();  ///< of the newest picture that arrived
  std::uint64_t next_sequence = 0;                                       ///< what follows if nothing is lost
  std::vector<std::string> notes;                                        ///< for the next Entry
  int dropped = 0;                                                       ///< by keep_newest, until somebody counts it

  /// Puts an item into the queue, or drops it with a note where its time goes back. Fish-eye pictures of one time are a
  /// bracket.
  void accept(SourceItem item);
  /// Drops what waits longest, notes too, beyond so many.
  void keep_newest(std::size_t count);
  /// Takes the front of the queue; notes before it and the loss of it become warnings.
  SourceItem pop(std::vector<std::string>& warnings);
};

}  // namespace lumigraft::capture
