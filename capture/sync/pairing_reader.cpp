#include "capture/sync/pairing_reader.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace lumigraft::capture {
namespace {

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::size_t kMaxAhead = 16;     ///< colour frames read ahead while another stream is late
constexpr std::size_t kPeriodsKept = 15;  ///< their median is the colour period
constexpr std::int64_t kLongestLiveBound_ns = 250 * kNsPerMs;
constexpr std::size_t kMaxBuffered = 64;  ///< frames read from a live source at a time

std::int64_t period_between(const Stamp& a, const Stamp& b) {
  return (b.time_ns - a.time_ns) / static_cast<std::int64_t>(std::max<std::uint64_t>(b.sequence - a.sequence, 1));
}

std::string alone_text(Stream stream, int count) {
  return std::to_string(count) + " " + name_of(stream) + (count == 1 ? " picture" : " pictures") +
         " late or without a colour picture: dropped";
}

}  // namespace

PairingReader::PairingReader(PairedSources sources) : sources_(std::move(sources)) {
  color_.source = sources_.color.get();
  depth_.source = sources_.depth.get();
  fisheye_.source = sources_.fisheye.get();
  fisheye_.offset_ns = sources_.fisheye_offset_ns;
}

StreamLane& PairingReader::lane_of(Stream stream) {
  return stream == Stream::color ? color_ : stream == Stream::depth ? depth_ : fisheye_;
}

bool PairingReader::pull(Source& source, std::chrono::milliseconds timeout) {
  std::optional<SourceItem> item = source.next(timeout);
  if (item) {
    StreamLane& lane = lane_of(stream_of(*item));
    if (std::string warning = source.take_warning(); !warning.empty()) lane.notes.push_back(std::move(warning));
    lane.accept(std::move(*item));
    if (sources_.live) lane.keep_newest(kMaxAhead);  // colour may be disconnected for hours while the others continue
  }
  return item.has_value();
}

void PairingReader::pull_all_waiting() {
  using namespace std::chrono_literals;
  for (Source* source : {color_.source, depth_.source, fisheye_.source}) {
    // To the end of a bracket; bounded, since a source may always have another frame.
    for (std::size_t i = 0; i < kMaxBuffered && source != nullptr && pull(*source, 0ms); ++i) {
    }
  }
}

std::vector<const StreamLane::Entry*> PairingReader::good_entries() const {
  std::vector<const StreamLane::Entry*> out;
  for (const StreamLane::Entry& entry : color_.queue) {
    if (!is_lost(entry.item)) out.push_back(&entry);
  }
  return out;
}

std::vector<const Stamp*> PairingReader::good_colors() const {
  std::vector<const Stamp*> out;
  for (const StreamLane::Entry* entry : good_entries()) out.push_back(&stamp_of(entry->item));
  return out;
}

/// Half the median period of the newest colour frames, including the first queued one and its successor but no later
/// ones, so that it does not depend on how far a source was read ahead.
std::int64_t PairingReader::bound_ns() const {
  constexpr std::int64_t kUsualPeriod = 33 * kNsPerMs;
  std::vector<std::int64_t> periods(periods_ns_.begin(), periods_ns_.end());
  const std::vector<const Stamp*> good = good_colors();
  if (last_color_ && !good.empty()) periods.push_back(period_between(*last_color_, *good[0]));
  if (good.size() > 1) periods.push_back(period_between(*good[0], *good[1]));
  if (periods.empty()) return kUsualPeriod / 2;
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  // A live camera's longest period may be a time in which it was disconnected.
  return std::clamp(*middle / 2, kNsPerMs, sources_.live ? kLongestLiveBound_ns : kLatest_ns);
}

/// Of a recording: the source to read next before the first colour frame can be paired with certainty; null if it can
/// be paired now.
Source* PairingReader::wanted() const {
  const std::vector<const Stamp*> good = good_colors();
  constexpr std::size_t kEnough = 2;  // the second determines the period
  if (good.size() < kEnough && !color_.source->finished() && (good.empty() || color_.queue.size() < kMaxAhead)) {
    return color_.source;
  }
  if (good.empty()) return nullptr;
  const std::int64_t time_ns = good[0]->time_ns;
  const auto must_read = [&](const StreamLane& lane, std::int64_t until_ns) {
    const bool color_piles_up = lane.source == color_.source && color_.queue.size() >= kMaxAhead;
    return lane.source != nullptr && !lane.source->finished() && lane.last_time_ns < until_ns && !color_piles_up &&
           lane.source->fault().empty();
  };
  if (must_read(depth_, time_ns)) return depth_.source;
  // A bracket is complete once a later frame has arrived.
  if (must_read(fisheye_, time_ns + bound_ns() + 1)) return fisheye_.source;
  return nullptr;
}

std::optional<FrameSet> PairingReader::next(std::chrono::milliseconds timeout) {
  if (sources_.live) return next_live(timeout);
  while (Source* source = wanted()) {
    if (!pull(*source, timeout) && !source->finished()) return std::nullopt;
  }
  return good_colors().empty() ? std::nullopt : std::optional<FrameSet>(emit());
}

/// Whether a depth frame that has not arrived may be the nearest to this time.
bool PairingReader::depth_may_come(std::int64_t time_ns) const {
  const Source* source = depth_.source;
  if (source == nullptr || source->finished() || !source->fault().empty() || depth_.last_time_ns >= time_ns) {
    return false;
  }
  const std::optional<std::int64_t> period_ns = depth_.period_ns();
  if (!period_ns) return true;
  const std::int64_t after_ns = depth_.last_time_ns + *period_ns - time_ns, before_ns = time_ns - depth_.last_time_ns;
  return after_ns <= bound_ns() && (before_ns > bound_ns() || after_ns < before_ns);
}

/// The index, among the good colour frames, of the one to give now: the newest with depth, or, where the newest waits
/// for none any more and no older one has it, the newest.
std::optional<std::size_t> PairingReader::newest_ready(StreamLane::Clock::time_point now) const {
  const std::vector<const StreamLane::Entry*> good = good_entries();
  const std::int64_t bound = bound_ns();
  for (std::size_t newest = good.size(); newest-- > 0;) {
    const bool waits = now < good[newest]->arrived + std::chrono::nanoseconds(2 * bound);
    if (waits && depth_may_come(time_of(good[newest]->item))) continue;
    for (std::size_t i = newest + 1; i-- > 0;) {
      if (nearest_ns(depth_, false, time_of(good[i]->item), bound)) return i;
    }
    return newest;
  }
  return std::nullopt;
}

std::optional<FrameSet> PairingReader::next_live(std::chrono::milliseconds timeout) {
  using Clock = StreamLane::Clock;
  using std::chrono::milliseconds;
  const Clock::time_point deadline = Clock::now() + timeout;
  for (;;) {
    pull_all_waiting();
    const Clock::time_point now = Clock::now();
    if (const std::optional<std::size_t> ready = newest_ready(now)) return emit(*ready);
    const std::vector<const StreamLane::Entry*> good = good_entries();
    if (now >= deadline || (good.empty() && color_.source->finished())) return std::nullopt;
    Clock::time_point until = deadline;
    if (!good.empty()) until = std::min(until, good.front()->arrived + std::chrono::nanoseconds(2 * bound_ns()));
    pull(good.empty() ? *color_.source : *depth_.source,
         std::min(std::chrono::ceil<milliseconds>(until - now), milliseconds(50)));
  }
}

/// The first good colour frame after those that are skipped.
FrameSet PairingReader::emit(std::size_t skipped) {
  FrameSet set;
  const std::int64_t bound = bound_ns();
  if (const int dropped = std::exchange(color_.dropped, 0); dropped > 0) {
    set.warnings.push_back(std::to_string(dropped) + " damaged colour pictures dropped");
  }
  if (skipped > 0) {
    set.warnings.push_back(std::to_string(skipped) + " colour " + (skipped == 1 ? "picture" : "pictures") +
                           " skipped: newer ones had come");
  }
  SourceItem color = color_.pop(set.warnings);
  while (is_lost(color) || skipped > 0) {
    skipped -= is_lost(color) ? 0 : 1;
    color = color_.pop(set.warnings);
  }
  set.color = std::make_shared<const Frame>(std::move(std::get<Frame>(color)));
  const Stamp& stamp = set.color->stamp;
  set.index = stamp.sequence;
  set.time_ns = stamp.time_ns;
  if (last_color_) {
    periods_ns_.push_back(period_between(*last_color_, stamp));
    if (periods_ns_.size() > kPeriodsKept) periods_ns_.pop_front();
  }
  last_color_ = stamp;
  if (depth_.source != nullptr) set.raw_depth = take_depth(set.time_ns, bound, set.warnings);
  if (fisheye_.source != nullptr) set.fisheye = take_fisheye(set.time_ns, bound, set.warnings);
  if (finished()) {
    // Losses after the last colour frame are reported with the last FrameSet.
    while (!color_.queue.empty()) color_.pop(set.warnings);
    for (StreamLane* lane : {&color_, &depth_, &fisheye_}) {
      set.warnings.insert(set.warnings.end(), lane->notes.begin(), lane->notes.end());
      lane->notes.clear();
    }
  }
  return set;
}

/// The time nearest to `time_ns`, within the bound, of a frame in a lane, or of a lost frame if `lost`.
std::optional<std::int64_t> PairingReader::nearest_ns(const StreamLane& lane, bool lost, std::int64_t time_ns,
                                                      std::int64_t bound) {
  std::optional<std::int64_t> best_ns;
  for (const StreamLane::Entry& entry : lane.queue) {
    const std::int64_t distance = std::abs(time_of(entry.item) - time_ns);
    if (is_lost(entry.item) == lost && distance <= bound && (!best_ns || distance < std::abs(*best_ns - time_ns))) {
      best_ns = time_of(entry.item);
    }
  }
  return best_ns;
}

std::optional<std::int64_t> PairingReader::newest_ns(const StreamLane& lane, std::int64_t from_ns, std::int64_t to_ns) {
  std::optional<std::int64_t> newest;
  for (const StreamLane::Entry& entry : lane.queue) {
    const std::int64_t at_ns = time_of(entry.item);
    if (!is_lost(entry.item) && at_ns >= from_ns && at_ns <= to_ns) newest = std::max(newest.value_or(at_ns), at_ns);
  }
  return newest;
}

/// Takes the items of a lane up to those of `best_ns`, or to the loss nearest to `time_ns` where there are none, and
/// returns those of `best_ns`. False where neither is within the bound.
template <typename Item>
bool PairingReader::take(StreamLane& lane, std::optional<std::int64_t> best_ns, std::int64_t time_ns,
                         std::int64_t bound, std::vector<std::shared_ptr<const Item>>& out, Warnings& warnings) {
  const std::optional<std::int64_t> lost_ns = best_ns ? best_ns : nearest_ns(lane, true, time_ns, bound);
  const std::int64_t drop_to = lost_ns.value_or(time_ns - bound - 1);
  int alone = std::exchange(lane.dropped, 0);
  while (!lane.queue.empty() && time_of(lane.queue.front().item) <= drop_to) {
    SourceItem item = lane.pop(warnings);
    auto* taken = std::get_if<Item>(&item);
    if (taken != nullptr && taken->stamp.time_ns == best_ns) {
      out.push_back(std::make_shared<const Item>(std::move(*taken)));
    } else if (taken != nullptr) {
      ++alone;
    }
  }
  if (alone > 0) warnings.push_back(alone_text(&lane == &depth_ ? Stream::depth : Stream::fisheye, alone));
  return lost_ns.has_value();
}

std::shared_ptr<const RawDepth> PairingReader::take_depth(std::int64_t time_ns, std::int64_t bound,
                                                          Warnings& warnings) {
  std::vector<std::shared_ptr<const RawDepth>> out;
  if (!take(depth_, nearest_ns(depth_, false, time_ns, bound), time_ns, bound, out, warnings)) {
    warnings.push_back("no depth picture within " + ms_text(bound) + " of the colour picture");
  }
  return out.empty() ? nullptr : out.front();
}

std::vector<std::shared_ptr<const Frame>> PairingReader::take_fisheye(std::int64_t time_ns, std::int64_t bound,
                                                                      Warnings& warnings) {
  std::optional<std::int64_t> best_ns = nearest_ns(fisheye_, false, time_ns, bound);
  if (!best_ns && sources_.live) best_ns = newest_ns(fisheye_, time_ns - kLongestLiveBound_ns, time_ns);
  std::vector<std::shared_ptr<const Frame>> out;
  take(fisheye_, best_ns, time_ns, bound, out, warnings);
  return out;
}

std::vector<std::string> PairingReader::faults() const {
  std::vector<std::string> out;
  for (const Source* source : {color_.source, depth_.source, fisheye_.source}) {
    const std::string fault = source != nullptr ? source->fault() : "";
    if (!fault.empty() && std::find(out.begin(), out.end(), fault) == out.end()) out.push_back(fault);
  }
  return out;
}

void PairingReader::rewind() {
  for (StreamLane* lane : {&color_, &depth_, &fisheye_}) {
    const bool done = lane == &depth_ && lane->source == color_.source;
    if (lane->source != nullptr && !done) lane->source->rewind();
    StreamLane empty;
    empty.source = lane->source;
    empty.offset_ns = lane->offset_ns;
    *lane = std::move(empty);
  }
  last_color_.reset();
  periods_ns_.clear();
}

}  // namespace lumigraft::capture
