#include "capture/record/recording_lanes.h"

#include <utility>

#include "capture/live/thread_priority.h"

namespace lumigraft::capture {
namespace {

constexpr int kBehindThePicture = 10;
constexpr int kBehindEverything = 19;
constexpr std::array kStreams = {Stream::color, Stream::depth, Stream::fisheye};

}  // namespace

RecordingLanes::RecordingLanes(const SessionText& text, const Session& session, const std::filesystem::path& folder,
                               bool behind)
    : recorder_(text, session, folder, behind ? DepthCoding::uncompressed : DepthCoding::ffv1) {
  for (const Stream stream : kStreams) {
    writers_[static_cast<std::size_t>(stream)] = std::jthread([this, stream, behind] { write(stream, behind); });
  }
}

RecordingLanes::~RecordingLanes() { finish(); }

void RecordingLanes::put(SourceItem item, bool live) {
  Lane& lane = lanes_[static_cast<std::size_t>(stream_of(item))];
  const std::uint64_t sequence = stamp_of(item).sequence;
  std::unique_lock lock(lane.mutex);
  if (lane.next_sequence && sequence > *lane.next_sequence) {
    lane.count.lost += sequence - *lane.next_sequence;
  }
  lane.next_sequence = sequence + 1;
  if (std::holds_alternative<LostPicture>(item) || (live && lane.waiting.size() >= kMost)) {
    ++lane.count.lost;
    return;
  }
  lane.changed.wait(lock, [&lane] { return lane.waiting.size() < kMost || lane.closed; });
  lane.waiting.push_back(std::move(item));
  lane.changed.notify_all();
}

/// Empty: closed, and all was taken.
std::optional<SourceItem> RecordingLanes::take(Lane& lane) const {
  std::unique_lock lock(lane.mutex);
  lane.changed.wait(lock, [&lane] { return !lane.waiting.empty() || lane.closed; });
  if (lane.waiting.empty() || failure()) {
    return std::nullopt;
  }
  SourceItem item = std::move(lane.waiting.front());
  lane.waiting.pop_front();
  lane.changed.notify_all();
  return item;
}

void RecordingLanes::write(Stream stream, bool behind) {
  std::optional<ThreadPriority> niceness;
  if (behind) {
    niceness.emplace(kBehindThePicture);
  }
  Lane& lane = lanes_[static_cast<std::size_t>(stream)];
  try {
    while (const std::optional<SourceItem> item = take(lane)) {
      const bool kept = recorder_.write(stream, *item);
      const std::lock_guard lock(lane.mutex);
      ++(kept ? lane.count.pictures : lane.count.unusable);
    }
  } catch (...) {
    {
      const std::lock_guard lock(mutex_);
      failure_ = failure_ ? failure_ : std::current_exception();
    }
    close();
  }
}

void RecordingLanes::close() {
  for (Lane& lane : lanes_) {
    const std::lock_guard lock(lane.mutex);
    lane.closed = true;
    lane.changed.notify_all();
  }
}

void RecordingLanes::finish() {
  close();
  for (std::jthread& writer : writers_) {
    if (writer.joinable()) {
      writer.join();
    }
  }
}

void RecordingLanes::compress_depth(const std::stop_token& stop) {
  const ThreadPriority niceness(kBehindEverything);
  recorder_.compress_depth(stop);
}

std::exception_ptr RecordingLanes::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

RecordingLanes::Count RecordingLanes::count(Stream stream) const {
  const Lane& lane = lanes_[static_cast<std::size_t>(stream)];
  const std::lock_guard lock(lane.mutex);
  return lane.count;
}

}  // namespace lumigraft::capture
