#include "capture/sync/stream_lane.h"

#include <algorithm>
#include <utility>

namespace lumigraft::capture {
namespace {

std::string lost_text(const SourceItem& item) {
  const auto& lost = std::get<LostFrame>(item);
  return std::string(name_of(lost.stream)) + " picture " + std::to_string(lost.stamp.sequence) +
         " lost: " + lost.reason;
}

}  // namespace

void StreamLane::accept(SourceItem item, Clock::time_point now) {
  const Stream stream = stream_of(item);
  Stamp stamp = stamp_of(item);
  const std::string name = name_of(stream);
  if (stamp.sequence > next_sequence) {
    notes.push_back(std::to_string(stamp.sequence - next_sequence) + " " + name + " pictures missing before picture " +
                    std::to_string(stamp.sequence));
  }
  const auto steps = static_cast<std::int64_t>(std::max(stamp.sequence + 1, next_sequence + 1) - next_sequence);
  next_sequence = stamp.sequence + 1;
  if (stamp.time_ns > kLatest_ns || stamp.time_ns < -kLatest_ns) {
    notes.push_back(name + " picture " + std::to_string(stamp.sequence) + " has an impossible time: dropped");
    return;
  }
  if (offset_ns != 0) {
    stamp.time_ns += offset_ns;
    std::visit([&](auto& any) { any.stamp = stamp; }, item);
  }
  const bool bracket = stream == Stream::fisheye && stamp.time_ns == last_time_ns;
  if (stamp.time_ns <= last_time_ns && !bracket) {
    notes.push_back(is_lost(item) ? lost_text(item)
                                  : name + " picture " + std::to_string(stamp.sequence) + " is " +
                                        ms_text(last_time_ns - stamp.time_ns) + " older than the one before: dropped");
    return;
  }
  constexpr std::size_t kPeriods = 15;  // their median is the period
  if (!bracket && last_time_ns != std::numeric_limits<std::int64_t>::min()) {
    periods_ns.push_back((stamp.time_ns - last_time_ns) / steps);
    if (periods_ns.size() > kPeriods) periods_ns.pop_front();
  }
  last_time_ns = stamp.time_ns;
  queue.push_back({std::move(item), now, std::move(notes)});
  notes.clear();
}

std::optional<std::int64_t> StreamLane::period_ns() const {
  if (periods_ns.empty()) return std::nullopt;
  std::vector<std::int64_t> periods(periods_ns.begin(), periods_ns.end());
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::ranges::nth_element(periods, middle);
  return *middle;
}

void StreamLane::keep_newest(std::size_t count) {
  while (queue.size() > count) {
    queue.pop_front();
    ++dropped;
  }
  if (notes.size() > count) notes.erase(notes.begin());
}

SourceItem StreamLane::pop(std::vector<std::string>& warnings) {
  Entry entry = std::move(queue.front());
  queue.pop_front();
  warnings.insert(warnings.end(), entry.notes.begin(), entry.notes.end());
  if (is_lost(entry.item)) warnings.push_back(lost_text(entry.item));
  return std::move(entry.item);
}

}  // namespace lumigraft::capture
