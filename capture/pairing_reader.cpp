#include "capture/pairing_reader.h"

#include <algorithm>
#include <cstdlib>

namespace lumigraft {
namespace {

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::size_t kMostAhead = 16;    ///< colour pictures read ahead while another stream is behind
constexpr std::size_t kPeriodsKept = 15;  ///< their median is the colour period

const Stamp& stamp_of(const SourceItem& item) {
  return std::visit([](const auto& i) -> const Stamp& { return i.stamp; }, item);
}

Stream stream_of(const SourceItem& item) {
  if (const auto* picture = std::get_if<Picture>(&item)) {
    return picture->stream;
  }
  const auto* lost = std::get_if<LostPicture>(&item);
  return lost != nullptr ? lost->stream : Stream::depth;
}

bool is_lost(const SourceItem& item) { return std::holds_alternative<LostPicture>(item); }

std::int64_t time_of(const SourceItem& item) { return stamp_of(item).time_ns; }

const char* name_of(Stream stream) {
  return stream == Stream::color ? "colour" : stream == Stream::depth ? "depth" : "fish-eye";
}

std::string ms_text(std::int64_t ns) { return std::to_string((ns + kNsPerMs / 2) / kNsPerMs) + " ms"; }

std::string lost_text(const SourceItem& item) {
  const auto& lost = std::get<LostPicture>(item);
  return std::string(name_of(lost.stream)) + " picture " + std::to_string(lost.stamp.sequence) +
         " lost: " + lost.reason;
}

std::string alone_text(Stream stream, int count) {
  return std::to_string(count) + " " + name_of(stream) + (count == 1 ? " picture" : " pictures") +
         " late or without a colour picture: dropped";
}

}  // namespace

PairingReader::PairingReader(PairedSources sources, Registration registration)
    : sources_(std::move(sources)), registration_(std::move(registration)) {
  color_.source = sources_.color.get();
  depth_.source = sources_.depth.get();
  fisheye_.source = sources_.fisheye.get();
}

PairingReader::Lane& PairingReader::lane_of(Stream stream) {
  return stream == Stream::color ? color_ : stream == Stream::depth ? depth_ : fisheye_;
}

/// Puts an item into its lane, or drops it with a warning where its time goes back.
void PairingReader::accept(SourceItem item) {
  const Stream stream = stream_of(item);
  const Stamp stamp = stamp_of(item);
  Lane& lane = lane_of(stream);
  const std::string name = name_of(stream);
  if (stamp.sequence > lane.next_sequence) {
    lane.warnings.push_back(std::to_string(stamp.sequence - lane.next_sequence) + " " + name +
                            " pictures missing before picture " + std::to_string(stamp.sequence));
  }
  lane.next_sequence = stamp.sequence + 1;
  const bool bracket = stream == Stream::fisheye && stamp.time_ns == lane.last_time_ns;
  if (stamp.time_ns <= lane.last_time_ns && !bracket) {
    lane.warnings.push_back(name + " picture " + std::to_string(stamp.sequence) +
                            " is not newer than the one before (" + ms_text(lane.last_time_ns - stamp.time_ns) +
                            "): dropped");
    return;
  }
  if (stream == Stream::color && lane.last_time_ns >= 0) {
    periods_ns_.push_back(stamp.time_ns - lane.last_time_ns);
    if (periods_ns_.size() > kPeriodsKept) {
      periods_ns_.pop_front();
    }
  }
  lane.last_time_ns = stamp.time_ns;
  lane.queue.push_back(std::move(item));
}

bool PairingReader::pull(Source& source, std::chrono::milliseconds timeout) {
  std::optional<SourceItem> item = source.next(timeout);
  if (item) {
    accept(std::move(*item));
  }
  return item.has_value();
}

void PairingReader::pull_all_waiting() {
  using namespace std::chrono_literals;
  for (Source* source : {color_.source, depth_.source, fisheye_.source}) {
    // As many as a device may have buffered; a source that never runs dry must not keep us here.
    for (std::size_t i = 0; i < kMostAhead && source != nullptr && pull(*source, 0ms); ++i) {
    }
  }
}

std::int64_t PairingReader::period_ns() const {
  constexpr std::int64_t kUsual = 33 * kNsPerMs;
  if (periods_ns_.empty()) {
    return kUsual;
  }
  std::vector<std::int64_t> sorted(periods_ns_.begin(), periods_ns_.end());
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  return sorted[sorted.size() / 2];
}

std::int64_t PairingReader::bound_ns() const { return std::max(period_ns() / 2, kNsPerMs); }

bool PairingReader::color_waits() const {
  return std::any_of(color_.queue.begin(), color_.queue.end(), [](const SourceItem& i) { return !is_lost(i); });
}

/// The source to read before the first colour picture can be paired for certain; null when it can.
Source* PairingReader::wanted() const {
  const auto good =
      std::count_if(color_.queue.begin(), color_.queue.end(), [](const SourceItem& i) { return !is_lost(i); });
  const std::ptrdiff_t enough = sources_.live ? 1 : 2;  // the second tells the period
  if (good < enough && !color_.source->finished() && (good == 0 || color_.queue.size() < kMostAhead)) {
    return color_.source;
  }
  if (good == 0) {
    return nullptr;
  }
  const auto first =
      std::find_if(color_.queue.begin(), color_.queue.end(), [](const SourceItem& i) { return !is_lost(i); });
  const std::int64_t time_ns = time_of(*first);
  const auto must_read = [&](const Lane& lane, std::int64_t until_ns) {
    const bool color_piles_up = lane.source == color_.source && color_.queue.size() >= kMostAhead;
    return lane.source != nullptr && !lane.source->finished() && lane.last_time_ns < until_ns && !color_piles_up;
  };
  if (must_read(depth_, time_ns)) {
    return depth_.source;
  }
  // A bracket is complete when a later picture is there. Live, the fish-eye is never waited for: its light is slow.
  if (!sources_.live && must_read(fisheye_, time_ns + bound_ns() + 1)) {
    return fisheye_.source;
  }
  return nullptr;
}

std::optional<FrameSet> PairingReader::next(std::chrono::milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  using std::chrono::milliseconds;
  if (!sources_.live) {
    while (Source* source = wanted()) {
      if (!pull(*source, timeout) && !source->finished()) {
        return std::nullopt;
      }
    }
    return color_waits() ? std::optional<FrameSet>(emit()) : std::nullopt;
  }
  const Clock::time_point deadline = Clock::now() + timeout;
  std::optional<Clock::time_point> color_deadline;
  for (;;) {
    pull_all_waiting();
    Source* source = wanted();
    const Clock::time_point now = Clock::now();
    if (color_waits() && !color_deadline) {
      color_deadline = now + std::chrono::nanoseconds(period_ns());
    }
    if (color_waits() && (source == nullptr || now >= *color_deadline)) {
      return emit();
    }
    if (source == nullptr || now >= deadline) {
      return std::nullopt;
    }
    const Clock::time_point until = color_deadline ? std::min(deadline, *color_deadline) : deadline;
    const auto wait = std::chrono::ceil<milliseconds>(std::max(until - now, Clock::duration::zero()));
    pull(*source, std::min(wait, milliseconds(50)));
  }
}

FrameSet PairingReader::emit() {
  FrameSet set;
  set.color = take_color(set.warnings);
  set.index = set.color->stamp.sequence;
  set.time_ns = set.color->stamp.time_ns;
  if (depth_.source != nullptr) {
    set.depth = take_depth(set.time_ns, set.warnings);
  }
  if (fisheye_.source != nullptr) {
    set.fisheye = take_fisheye(set.time_ns, set.warnings);
  }
  // Colour pictures lost at the very end have no FrameSet of their own to be named in.
  if (color_.source->finished() && !color_waits()) {
    for (const SourceItem& item : color_.queue) {
      set.warnings.push_back(lost_text(item));
    }
    color_.queue.clear();
  }
  for (Lane* lane : {&color_, &depth_, &fisheye_}) {
    set.warnings.insert(set.warnings.end(), lane->warnings.begin(), lane->warnings.end());
    lane->warnings.clear();
  }
  return set;
}

std::shared_ptr<const Picture> PairingReader::take_color(std::vector<std::string>& warnings) {
  while (is_lost(color_.queue.front())) {
    warnings.push_back(lost_text(color_.queue.front()));
    color_.queue.pop_front();
  }
  auto picture = std::make_shared<const Picture>(std::move(std::get<Picture>(color_.queue.front())));
  color_.queue.pop_front();
  return picture;
}

std::shared_ptr<const DepthPicture> PairingReader::take_depth(std::int64_t time_ns,
                                                              std::vector<std::string>& warnings) {
  const std::int64_t bound = bound_ns();
  std::deque<SourceItem>& queue = depth_.queue;
  auto best = queue.end();
  for (auto it = queue.begin(); it != queue.end(); ++it) {
    const std::int64_t distance = std::abs(time_of(*it) - time_ns);
    const bool nearer = best == queue.end() || distance < std::abs(time_of(*best) - time_ns);
    if (!is_lost(*it) && distance <= bound && nearer) {
      best = it;
    }
  }
  std::shared_ptr<const DepthPicture> out;
  std::int64_t drop_before = time_ns - bound;
  if (best != queue.end()) {
    const auto& raw = std::get<RawDepth>(*best);
    auto depth = std::make_shared<DepthPicture>();
    depth->stamp = raw.stamp;
    depth->depth_m = registration_(raw.counts);
    drop_before = raw.stamp.time_ns;
    out = std::move(depth);
  } else {
    warnings.push_back("no depth picture within " + ms_text(bound) + " of colour picture at " + ms_text(time_ns));
  }
  int alone = 0;
  while (!queue.empty() && time_of(queue.front()) < drop_before) {
    if (is_lost(queue.front())) {
      warnings.push_back(lost_text(queue.front()));
    } else {
      ++alone;
    }
    queue.pop_front();
  }
  if (out != nullptr) {
    queue.pop_front();
  }
  if (alone > 0) {
    warnings.push_back(alone_text(Stream::depth, alone));
  }
  return out;
}

std::vector<std::shared_ptr<const Picture>> PairingReader::take_fisheye(std::int64_t time_ns,
                                                                        std::vector<std::string>& warnings) {
  const std::int64_t bound = bound_ns();
  std::deque<SourceItem>& queue = fisheye_.queue;
  std::optional<std::int64_t> best_ns;
  for (const SourceItem& item : queue) {
    const std::int64_t distance = std::abs(time_of(item) - time_ns);
    if (!is_lost(item) && distance <= bound && (!best_ns || distance < std::abs(*best_ns - time_ns))) {
      best_ns = time_of(item);
    }
  }
  std::vector<std::shared_ptr<const Picture>> out;
  const std::int64_t drop_to = best_ns ? *best_ns : time_ns - bound - 1;
  int alone = 0;
  while (!queue.empty() && time_of(queue.front()) <= drop_to) {
    if (is_lost(queue.front())) {
      warnings.push_back(lost_text(queue.front()));
    } else if (best_ns && time_of(queue.front()) == *best_ns) {
      out.push_back(std::make_shared<const Picture>(std::move(std::get<Picture>(queue.front()))));
    } else {
      ++alone;
    }
    queue.pop_front();
  }
  if (alone > 0) {
    warnings.push_back(alone_text(Stream::fisheye, alone));
  }
  return out;
}

bool PairingReader::finished() const { return color_.source->finished() && !color_waits(); }

void PairingReader::rewind() {
  for (Lane* lane : {&color_, &depth_, &fisheye_}) {
    Source* source = lane->source;
    const bool seen = lane == &depth_ && source == color_.source;
    if (source != nullptr && !seen) {
      source->rewind();
    }
    *lane = Lane{};
    lane->source = source;
  }
  periods_ns_.clear();
}

}  // namespace lumigraft
